// The data of a report: script elements of the page itself.
import {typed, type Feed} from './feed';
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
    return typed(info.deflate ? await inflate(bytes) : bytes, name, info);
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

async function inflate(bytes: ArrayBuffer): Promise<ArrayBuffer> {
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();
}
