// Triangles, lines and marks into arrays of pixels, by the processor: what a GPU does, for machines without one. A browser's own replacement
// (SwiftShader) spends five times as long on a mesh of small triangles.

/** Pixels of a picture, the last ones not among them. */
export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** The pixels of a picture, line by line from the top. */
export interface Target {
  width: number;
  height: number;
  colours: Int32Array;   // r g b a, a byte each
  depth: Float32Array;   // 1 / distance: near is large, nothing is 0
  tiles: Float32Array;   // of 8 x 8 pixels each, the farthest of them; what `farthest` says
}

/** Tiles next to each other in a picture that wide. */
const tilesAcross = (width: number): number => width + 7 >> 3;

export function target(width: number, height: number, colours = new Int32Array(width * height)): Target {
  return {width, height, colours, depth: new Float32Array(width * height), tiles: new Float32Array(tilesAcross(width) * tilesAcross(height))};
}

/** Takes the tiles' depths from what has been drawn; all of it is in this box. */
export function farthest({width, height, depth, tiles}: Target, {left, top, right, bottom}: Box): void {
  const across = tilesAcross(width);
  for (let row = top >> 3; 8 * row < bottom; ++row) {
    for (let column = left >> 3; 8 * column < right; ++column) {
      const x = 8 * column, y = 8 * row, end = Math.min(width, x + 8), last = Math.min(height, y + 8);
      let least = Infinity;
      for (let line = y * width; line < last * width && least > 0; line += width) {
        for (let p = line + x; p < line + end; ++p) if (depth[p] < least) least = depth[p];
      }
      tiles[row * across + column] = least;
    }
  }
}

/** What a vertex has: x, y (pixels), 1 / distance (0: behind the eye), light of its front and of its back (0 to 255), row of its colour. */
export const stride = 6;

/** Of which triangles: those whose front one sees; whose back one sees, left out where all tiles that they touch are nearer; or all of them, as
    a ghost: half of what is behind shows through, and depth stays. */
export type Faces = 'front' | 'back' | 'ghost';

/** `row`: of their one colour in `shades`; -1 for the vertices' own. */
export function drawTriangles({width, height, colours, depth, tiles}: Target, v: Float32Array, triangles: Uint32Array, shades: Int32Array, row: number, faces: Faces): void {
  const own = row < 0, ghost = faces === 'ghost', front = faces === 'front', back = faces === 'back', across = tilesAcross(width);
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    let a = stride * triangles[t], b = stride * triangles[t + 1], c = stride * triangles[t + 2];
    if (!(v[a + 2] > 0 && v[b + 2] > 0 && v[c + 2] > 0)) continue;
    const isFront = (v[b] - v[a]) * (v[c + 1] - v[a + 1]) - (v[b + 1] - v[a + 1]) * (v[c] - v[a]) < 0;
    if (isFront ? back : front) continue;

    // From top to bottom: a, b, c
    let swap;
    if (v[b + 1] < v[a + 1]) { swap = a; a = b; b = swap; }
    if (v[c + 1] < v[b + 1]) {
      swap = b; b = c; c = swap;
      if (v[b + 1] < v[a + 1]) { swap = a; a = b; b = swap; }
    }
    const xa = v[a], ya = v[a + 1], xb = v[b], yb = v[b + 1], xc = v[c], yc = v[c + 1];
    let y = Math.max(0, Math.min(height, Math.ceil(ya - 0.5))) | 0;
    const end = Math.max(0, Math.min(height, Math.ceil(yc - 0.5))) | 0;
    if (y >= end) continue;
    if (back && hidden(tiles, across, Math.max(0, Math.min(xa, xb, xc)) >> 3, Math.min(width - 1, Math.max(xa, xb, xc)) >> 3, y >> 3, end - 1 >> 3, Math.max(v[a + 2], v[b + 2], v[c + 2]))) continue;

    // How depth, light and colour change to the right and downwards
    const abx = xb - xa, aby = yb - ya, acx = xc - xa, acy = yc - ya, area = abx * acy - acx * aby;
    if (area === 0) continue;
    const side = isFront ? 3 : 4, by = 1 / area, za = v[a + 2], la = v[a + side], ra = own ? v[a + 5] : row;
    const zb = v[b + 2] - za, zc = v[c + 2] - za, zx = (zb * acy - zc * aby) * by, zy = (zc * abx - zb * acx) * by;
    const lb = v[b + side] - la, lc = v[c + side] - la, lx = (lb * acy - lc * aby) * by, ly = (lc * abx - lb * acx) * by;
    let rx = 0, ry = 0;
    if (own) {
      const rb = v[b + 5] - ra, rc = v[c + 5] - ra;
      rx = (rb * acy - rc * aby) * by;
      ry = (rc * abx - rb * acx) * by;
    }
    const nearer = ghost ? 2 * (Math.abs(zx) + Math.abs(zy)) + 1e-6 * za : 0;  // over what is as near

    // Line by line, the pixels whose middle is inside
    const along = acx / acy, above = abx / aby, below = (xc - xb) / (yc - yb), bIsRight = area > 0;
    for (; y < end; ++y) {
      const down = y + 0.5 - ya, one = xa + down * along, other = y + 0.5 < yb ? xa + down * above : xb + (y + 0.5 - yb) * below;
      const first = Math.max(0, Math.min(width, Math.ceil((bIsRight ? one : other) - 0.5))) | 0;
      const last = Math.max(0, Math.min(width, Math.ceil((bIsRight ? other : one) - 0.5))) | 0;
      if (first >= last) continue;
      const right = first + 0.5 - xa;
      let z = za + nearer + zx * right + zy * down, l = la + lx * right + ly * down, r = ra + rx * right + ry * down;
      for (let p = y * width + first, stop = y * width + last; p < stop; ++p) {
        if (z > depth[p]) {
          const colour = shades[(r & 255) << 8 | l & 255];
          if (ghost) {
            const behind = colours[p];
            colours[p] = ((colour ^ behind) >>> 1 & 0x7f7f7f7f) + (colour & behind);
          } else {
            depth[p] = z;
            colours[p] = colour;
          }
        }
        z += zx;
        l += lx;
        r += rx;
      }
    }
  }
}

function hidden(tiles: Float32Array, across: number, left: number, right: number, top: number, bottom: number, nearest: number): boolean {
  for (let y = top; y <= bottom; ++y) for (let x = left; x <= right; ++x) if (!(tiles[y * across + x] > nearest)) return false;
  return true;
}

/** Lines of a pixel, where nothing is clearly nearer. */
export function drawLines({width, height, colours, depth}: Target, v: Float32Array, lines: Uint32Array, shades: Int32Array, row: number): void {
  const slack = 1.004;  // a line is at the depth of the surface that it lies on
  for (let i = 0; i + 1 < lines.length; i += 2) {
    const a = stride * lines[i], b = stride * lines[i + 1];
    if (!(v[a + 2] > 0 && v[b + 2] > 0)) continue;
    // one pixel of each column, or of each line where it is steep
    const steep = Math.abs(v[b + 1] - v[a + 1]) > Math.abs(v[b] - v[a]), main = steep ? 1 : 0, size = steep ? height : width, other = steep ? width : height;
    const from = v[a + main], across = v[a + 1 - main], by = 1 / (v[b + main] - from), slope = (v[b + 1 - main] - across) * by;
    const first = Math.max(0, Math.ceil(Math.min(from, v[b + main]) - 0.5)), last = Math.min(size, Math.ceil(Math.max(from, v[b + main]) - 0.5));
    for (let s = first; s < last; ++s) {
      const gone = s + 0.5 - from, o = Math.floor(across + gone * slope);
      if (!(o >= 0 && o < other)) continue;
      const p = steep ? s * width + o : o * width + s, share = gone * by;
      if ((v[a + 2] + share * (v[b + 2] - v[a + 2])) * slack < depth[p]) continue;
      const r = row < 0 ? v[a + 5] + share * (v[b + 5] - v[a + 5]) : row, l = v[a + 3] + share * (v[b + 3] - v[a + 3]);
      colours[p] = shades[(r & 255) << 8 | l & 255];
    }
  }
}
