// Arrays of float32 and float64 out of an .npz file, as `kpsa eval` writes them.
import {inflateRawSync} from 'node:zlib';

/** {name: {shape, data}} of all arrays of the file. */
export function readNpz(bytes) {
  const arrays = {};
  let end = bytes.length - 22;
  while (bytes.readUInt32LE(end) !== 0x06054b50) --end;
  let at = bytes.readUInt32LE(end + 16);
  for (let count = bytes.readUInt16LE(end + 10); count > 0; --count) {
    const method = bytes.readUInt16LE(at + 10), packed = bytes.readUInt32LE(at + 20), nameLength = bytes.readUInt16LE(at + 28);
    const name = bytes.toString('utf8', at + 46, at + 46 + nameLength), local = bytes.readUInt32LE(at + 42);
    const begin = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
    const stored = bytes.subarray(begin, begin + packed);
    arrays[name.replace(/\.npy$/, '')] = readNpy(method === 8 ? inflateRawSync(stored) : stored);
    at += 46 + nameLength + bytes.readUInt16LE(at + 30) + bytes.readUInt16LE(at + 32);
  }
  return arrays;
}

function readNpy(bytes) {
  const long = bytes[6] > 1, length = long ? bytes.readUInt32LE(8) : bytes.readUInt16LE(8), begin = (long ? 12 : 10) + length;
  const header = bytes.toString('latin1', long ? 12 : 10, begin);
  const kind = /'descr': *'<(f4|f8)'/.exec(header)?.[1];
  if (!kind) throw new Error(`an array of a kind that is not read: ${header}`);
  const shape = /'shape': *\(([^)]*)\)/.exec(header)[1].split(',').filter((s) => s.trim()).map(Number);
  const count = shape.reduce((a, b) => a * b, 1), copy = Uint8Array.from(bytes.subarray(begin, begin + count * (kind === 'f4' ? 4 : 8)));
  return {shape, data: kind === 'f4' ? new Float32Array(copy.buffer) : new Float64Array(copy.buffer)};
}
