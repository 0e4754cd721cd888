// Writes a report as docs/viewer-data.md says.
import {deflateSync} from 'node:zlib';
import {readFileSync} from 'node:fs';

export const page = new URL('../../dist/viewer.html', import.meta.url);

export function makeReport({meta, arrays}) {
  const parts = [`<script type="application/json" id="kpsa-meta">${JSON.stringify(meta).replaceAll('<', '\\u003c')}</script>`];
  for (const [name, array] of Object.entries(arrays)) {
    const raw = Buffer.from(array.buffer, array.byteOffset, array.byteLength), bytes = meta.blobs[name].deflate ? deflateSync(raw) : raw;
    parts.push(`<script type="application/octet-stream" id="kpsa-blob-${name}">${bytes.toString('base64')}</script>`);
  }
  return readFileSync(page, 'utf8').replace('<!--kpsa:data-->', () => parts.join('\n'));
}
