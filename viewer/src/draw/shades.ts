// Colours under light, looked up by both: what the shaders of gpu_materials.ts compute for a pixel.

type Colour = readonly [number, number, number];

/** A light of 255 in the table. */
export const mostLight = 1.25;

/** How light a place is whose normal, as the eye sees it, has these cosines to the two lights, and this part upwards. */
export function lightOf(key: number, fill: number, up: number): number {
  const light = 0.26 + 0.66 * Math.max(key, 0) + 0.16 * Math.max(fill, 0) + 0.08 * up;
  return Math.min(255, Math.max(0, light * (255 / mostLight)));
}

export const keyLight: Colour = [0.32, 0.48, 0.816], fillLight: Colour = [-0.6, 0.1, 0.79];

/** r g b a in the order of bytes that pictures have. */
export function pixel(r: number, g: number, b: number): number {
  return 255 << 24 | byte(b) << 16 | byte(g) << 8 | byte(r);
}

const byte = (part: number): number => Math.min(255, Math.max(0, Math.round(255 * part)));

/** Up to 256 colours, each of them 256 times: as `row << 8 | light`. */
export class Shades {
  readonly surface = new Int32Array(65536);
  readonly lines = new Int32Array(65536);
  private of: Uint8Array | null = null;
  private withLines = false;

  /** Of a table of r g b a. `painted`: colours that say something, which light changes less. The table it has is not computed again. */
  set(table: Uint8Array, painted: boolean, withLines: boolean): void {
    if (table === this.of && (this.withLines || !withLines)) return;
    this.of = table;
    this.withLines = withLines;
    for (let row = 0; 4 * row < table.length; ++row) {
      const r = table[4 * row] / 255, g = table[4 * row + 1] / 255, b = table[4 * row + 2] / 255, isLight = 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.3;
      for (let i = 0; i < 256; ++i) {
        let light = i / 255 * mostLight;
        if (painted) light = 0.45 + 0.6 * light;
        const lit = (part: number): number => Math.min(1, part * light), line = (part: number): number => isLight ? lit(part) * 0.45 : lit(part) * 0.65 + 0.35;
        this.surface[row << 8 | i] = pixel(lit(r), lit(g), lit(b));
        if (withLines) this.lines[row << 8 | i] = pixel(line(r), line(g), line(b));
      }
    }
  }
}

/** At most 256 colours of 0 to 1. */
export function tableOf(colours: readonly Colour[]): Uint8Array {
  return Uint8Array.from(colours.slice(0, 256).flatMap((colour) => [...colour.map(byte), 255]));
}
