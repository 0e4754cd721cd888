// Where a page has its data from: inside itself, or a server on the loopback.
import type {BlobArray, BlobInfo, Meta} from './meta';

export interface Feed {
  readonly live: boolean;
  meta(): Promise<Meta>;
  blob(name: string, info: BlobInfo): Promise<BlobArray>;
}

const bytesOf = {f32: 4, u32: 4, i16: 2, i8: 1, u8: 1} as const;

/** How many bytes a blob has when it is inflated. */
export function sizeOf(name: string, info: BlobInfo): number {
  const size = info.count * bytesOf[info.type];
  if (!Number.isSafeInteger(info.count) || info.count < 0 || !Number.isSafeInteger(size)) throw new Error(`blob ${name} has no type or count that this viewer knows`);
  return size;
}

/** The array that raw bytes are, checked for length. */
export function typed(bytes: ArrayBuffer, name: string, info: BlobInfo): BlobArray {
  const expected = sizeOf(name, info);
  if (bytes.byteLength !== expected) throw new Error(`blob ${name} has ${bytes.byteLength} bytes, not ${expected}`);
  switch (info.type) {
    case 'f32': return new Float32Array(bytes);
    case 'u32': return new Uint32Array(bytes);
    case 'i16': return new Int16Array(bytes);
    case 'i8': return new Int8Array(bytes);
    case 'u8': return new Uint8Array(bytes);
  }
}
