// The arrays of an .npz that kpsa eval wrote (stored entries): [{name, shape, values}], in their order.
export function readNpz(file) {
  const bytes = new Uint8Array(file);  // a Buffer's slices are no copies
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const arrays = [];
  for (let at = 0; view.getUint32(at, true) === 0x04034b50;) {
    const nameLength = view.getUint16(at + 26, true), extraLength = view.getUint16(at + 28, true);
    const name = new TextDecoder().decode(bytes.subarray(at + 30, at + 30 + nameLength));
    const start = at + 30 + nameLength + extraLength;
    const version = bytes[start + 6];
    const headLength = version === 1 ? view.getUint16(start + 8, true) : view.getUint32(start + 8, true);
    const data = start + (version === 1 ? 10 : 12) + headLength;
    const head = new TextDecoder().decode(bytes.subarray(start + 8, data));
    const shape = head.match(/'shape': \(([^)]*)\)/)[1].split(',').filter((n) => n.trim()).map(Number);
    const count = shape.reduce((a, b) => a * b, 1);
    const Numbers = head.includes('<f8') ? Float64Array : Float32Array;
    const end = data + count * Numbers.BYTES_PER_ELEMENT;
    arrays.push({ name: name.replace(/\.npy$/, ''), shape, values: new Numbers(bytes.slice(data, end).buffer) });
    at = end;
  }
  return arrays;
}
