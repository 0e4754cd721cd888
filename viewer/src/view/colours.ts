// Colours of errors and of fields; the shader and the legend use the same ones.

type Stop = readonly [at: number, colour: readonly [number, number, number]];

// Errors in units of the tolerance: cool below it, a jump to warm above it.
const errorStops: readonly Stop[] = [
  [0, [47, 64, 128]], [0.25, [44, 122, 168]], [0.5, [62, 166, 150]], [0.75, [150, 200, 105]], [1, [236, 222, 110]],
  [1.0001, [242, 142, 56]], [1.5, [222, 70, 50]], [2, [180, 32, 74]], [4, [110, 16, 96]],
];

const fieldStops: readonly Stop[] = [[0, [70, 76, 88]], [0.35, [60, 110, 160]], [0.7, [86, 180, 170]], [1, [250, 226, 110]]];

function along(stops: readonly Stop[], t: number): [number, number, number] {
  let i = 1;
  while (i < stops.length - 1 && t > stops[i][0]) ++i;
  const [a, from] = stops[i - 1], [b, to] = stops[i];
  const s = Math.min(1, Math.max(0, (t - a) / (b - a)));
  return [0, 1, 2].map((c) => Math.round(from[c] + s * (to[c] - from[c]))) as [number, number, number];
}

export const errorColour = (inTolerances: number): [number, number, number] => along(errorStops, inTolerances);
export const fieldColour = (value: number): [number, number, number] => along(fieldStops, value);

/** r g b a of 256 colours that span 0 to `top` tolerances. */
export const errorTable = (top: number): Uint8Array<ArrayBuffer> => table((t) => errorColour(t * top));
export const fieldTable = (): Uint8Array<ArrayBuffer> => table(fieldColour);

function table(colour: (t: number) => [number, number, number]): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(Array.from({length: 256}, (_, i) => [...colour(i / 255), 255]).flat());
}

/** The same as a gradient of CSS, to the right. */
export function gradient(colour: (t: number) => [number, number, number], top: number): string {
  const steps = Array.from({length: 49}, (_, i) => `rgb(${colour(i / 48 * top).join(' ')}) ${(i / 48 * 100).toFixed(1)}%`);
  return `linear-gradient(to right, ${steps.join(', ')})`;
}

/** Colours of hits, blends and misses: apart in lightness as well. */
export const verdictNames = ['hit', 'blend', 'miss'] as const;
export type Verdict = typeof verdictNames[number];

/** The parts of #rrggbb, 0 to 1. */
export function rgb(hex: string): [number, number, number] {
  const match = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(hex.trim());
  return match ? [1, 2, 3].map((i) => parseInt(match[i], 16) / 255) as [number, number, number] : [0.72, 0.7, 0.67];
}
