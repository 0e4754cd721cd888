// Pixels of a PNG (8 bits, RGB or RGBA, not interlaced), and how many of two pictures differ.
import {inflateSync} from 'node:zlib';

export function decode(png) {
  const width = png.readUInt32BE(16), height = png.readUInt32BE(20), channels = png[25] === 6 ? 4 : 3, parts = [];
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + length));
    at += length + 12;
  }
  const raw = inflateSync(Buffer.concat(parts)), line = width * channels, data = new Uint8Array(line * height);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (line + 1)];
    for (let x = 0; x < line; ++x) {
      const a = x >= channels ? data[y * line + x - channels] : 0, b = y ? data[(y - 1) * line + x] : 0, c = x >= channels && y ? data[(y - 1) * line + x - channels] : 0;
      const p = a + b - c, pa = Math.abs(p - a), pb = Math.abs(p - b), pc = Math.abs(p - c);
      const guess = [0, a, b, (a + b) >> 1, pa <= pb && pa <= pc ? a : pb <= pc ? b : c][filter];
      data[y * line + x] = raw[y * (line + 1) + 1 + x] + guess;
    }
  }
  return {width, height, channels, data};
}

/** The share of pixels that differ by more than a little. */
export function difference(a, b) {
  const x = decode(a), y = decode(b);
  if (x.width !== y.width || x.height !== y.height) return 1;
  let count = 0;
  for (let i = 0; i < x.data.length; i += x.channels) {
    if (Math.abs(x.data[i] - y.data[i]) + Math.abs(x.data[i + 1] - y.data[i + 1]) + Math.abs(x.data[i + 2] - y.data[i + 2]) > 12) ++count;
  }
  return count / (x.width * x.height);
}

/** The share of pixels for which `is` holds of red, green and blue. */
export function share(png, is) {
  const {width, height, channels, data} = decode(png);
  let count = 0;
  for (let i = 0; i < data.length; i += channels) if (is(data[i], data[i + 1], data[i + 2])) ++count;
  return count / (width * height);
}

/** By how much lightness differs, 0 to 1, where it does by more than a little: the middle one of these pixels. */
export function contrast(a, b) {
  const x = decode(a), y = decode(b), found = [], light = (p, i) => (0.2126 * p[i] + 0.7152 * p[i + 1] + 0.0722 * p[i + 2]) / 255;
  for (let i = 0; i < x.data.length; i += x.channels) {
    const off = Math.abs(light(x.data, i) - light(y.data, i));
    if (off > 0.02) found.push(off);
  }
  return found.sort((p, q) => p - q)[found.length >> 1] ?? 0;
}
