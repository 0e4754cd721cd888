// PNG files of at most 256 colours (median cut), for pictures in the docs.
import {crc32, deflateSync} from 'node:zlib';

/** Of {width, height, channels, data} as decode gives it. */
export function encodePalette({width, height, channels, data}) {
  const count = new Map();  // colours of 5 bits a channel: how many, and their sums
  for (let i = 0; i < data.length; i += channels) {
    const key = data[i] >> 3 << 10 | data[i + 1] >> 3 << 5 | data[i + 2] >> 3, known = count.get(key);
    if (known) {
      ++known.n;
      for (let c = 0; c < 3; ++c) known.sum[c] += data[i + c];
    } else {
      count.set(key, {key, n: 1, sum: [data[i], data[i + 1], data[i + 2]]});
    }
  }
  const palette = medianCut([...count.values()]), index = new Map();
  palette.forEach((box, i) => box.forEach(({key}) => index.set(key, i)));
  const raw = Buffer.alloc(height * (width + 1));
  for (let y = 0, at = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x, at += channels) raw[y * (width + 1) + 1 + x] = index.get(data[at] >> 3 << 10 | data[at + 1] >> 3 << 5 | data[at + 2] >> 3);
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 3, 0, 0, 0], 8);
  const colours = Buffer.from(palette.flatMap((box) => mean(box)));
  return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', head), chunk('PLTE', colours), chunk('IDAT', deflateSync(raw, {level: 9})), chunk('IEND', Buffer.alloc(0))]);
}

function mean(box) {
  const n = box.reduce((sum, one) => sum + one.n, 0);
  return [0, 1, 2].map((c) => Math.round(box.reduce((sum, one) => sum + one.sum[c], 0) / n));
}

/** Boxes of colours, the one that is spread most (by its pixels' root) cut first. */
function medianCut(colours) {
  const spread = (box) => {
    let widest = 0, axis = 0;
    for (let c = 0; c < 3; ++c) {
      const at = box.map((one) => one.sum[c] / one.n), width = Math.max(...at) - Math.min(...at);
      if (width > widest) [widest, axis] = [width, c];
    }
    return {axis, weight: widest * Math.sqrt(box.reduce((sum, one) => sum + one.n, 0))};
  };
  const boxes = [{box: colours, ...spread(colours)}];
  while (boxes.length < 256) {
    const most = boxes.reduce((a, b) => b.weight > a.weight ? b : a);
    if (!(most.weight > 0)) break;
    const {box, axis} = most, sorted = box.sort((a, b) => a.sum[axis] / a.n - b.sum[axis] / b.n), half = box.reduce((sum, one) => sum + one.n, 0) / 2;
    let cut = 1;
    for (let n = sorted[0].n; cut < sorted.length - 1 && n + sorted[cut].n <= half; ++cut) n += sorted[cut].n;
    const [low, high] = [sorted.slice(0, cut), sorted.slice(cut)];
    boxes.splice(boxes.indexOf(most), 1, {box: low, ...spread(low)}, {box: high, ...spread(high)});
  }
  return boxes.map(({box}) => box);
}

function chunk(name, data) {
  const body = Buffer.concat([Buffer.from(name, 'latin1'), data]), out = Buffer.alloc(body.length + 8);
  out.writeUInt32BE(data.length, 0);
  body.copy(out, 4);
  out.writeUInt32BE(crc32(body) >>> 0, body.length + 4);
  return out;
}
