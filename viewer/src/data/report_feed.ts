// The data of a report: script elements of the page itself.
import {sizeOf, typed, type Feed} from './feed';
import {checkMeta, type BlobArray, type BlobInfo, type Meta} from './meta';

export function hasReport(): boolean {
  return document.getElementById('kpsa-meta') !== null;
}

export class ReportFeed implements Feed {
  readonly live = false;

  async meta(): Promise<Meta> {
    return checkMeta(JSON.parse(document.getElementById('kpsa-meta')?.textContent ?? 'null'));
  }

  async blob(name: string, info: BlobInfo): Promise<BlobArray> {
    const element = document.getElementById('kpsa-blob-' + name);
    if (!element) throw new Error(`blob ${name} is not in this page`);
    const bytes = fromBase64(element.textContent ?? '');
    element.remove();  // the model keeps the array; the text is as large again
    return typed(info.deflate ? await inflate(bytes, name, sizeOf(name, info)) : bytes, name, info);
  }
}

function fromBase64(text: string): ArrayBuffer {
  const native = Uint8Array as unknown as {fromBase64?: (text: string) => Uint8Array<ArrayBuffer>};
  if (native.fromBase64) return native.fromBase64(text).buffer;
  const binary = atob(text);  // both skip white space
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes.buffer;
}

const mostInflated = 1032;  // times as large is what deflate can make of its input

/** Never takes more memory than the blob says that it has. */
async function inflate(bytes: ArrayBuffer, name: string, expected: number): Promise<ArrayBuffer> {
  if (expected > mostInflated * bytes.byteLength + 64) throw new Error(`blob ${name} cannot have ${expected} bytes: it is ${bytes.byteLength} packed`);
  const out = new Uint8Array(expected), reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  let at = 0;
  for (;;) {
    const {done, value} = await reader.read();
    if (done) break;
    if (at + value.length > expected) {
      void reader.cancel().catch(() => undefined);
      throw new Error(`blob ${name} has more than ${expected} bytes`);
    }
    out.set(value, at);
    at += value.length;
  }
  if (at !== expected) throw new Error(`blob ${name} has ${at} bytes, not ${expected}`);
  return out.buffer;
}
