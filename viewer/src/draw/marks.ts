// Discs and diamonds at points: cues, the vertices that were picked, handles, and what is hovered or selected among them.

export interface Mark {
  vertex: number;  // -1: the offset is its place
  offset: readonly [number, number, number];
  diamond?: boolean;
}

type Colour = readonly [number, number, number];

/** Of all marks: of one that is hovered or selected, and of their rims. */
export const selectedColour: Colour = [1, 1, 1], rimColour: Colour = [0.05, 0.06, 0.08];
/** How much wider one that is hovered or selected is. */
export const selectedScale = 1.6;
/** Where the rim begins, of a radius of 1, and how much of it all covers what is behind. */
export const rimBegins = 0.62, cover = 0.95;

export class Marks {
  visible = true;
  /** Which of them is shown as hovered or selected; -1 for none. */
  emphasized = -1;
  marks: readonly Mark[] = [];
  private offsets = new Float32Array();
  private at = new Float32Array();

  /** `size`: how wide one is, in pixels of CSS. */
  constructor(readonly base: Colour, readonly size: number) {}

  set(marks: readonly Mark[]): void {
    this.marks = marks;
    this.offsets = Float32Array.from(marks.flatMap((mark) => [...mark.offset]));
    this.at = new Float32Array(3 * marks.length);
  }

  /** Takes them elsewhere; where a number is not known they stay. */
  move(offsets: readonly (number | null)[]): void {
    for (let i = 0; i < Math.min(this.offsets.length, offsets.length); ++i) this.offsets[i] = offsets[i] ?? this.offsets[i];
  }

  /** Where a mark without a vertex is. */
  offsetOf(index: number): [number, number, number] {
    return [this.offsets[3 * index], this.offsets[3 * index + 1], this.offsets[3 * index + 2]];
  }

  /** x y z of each of them; the array is used again by the next call. */
  places(points: Float32Array): Float32Array<ArrayBuffer> {
    const {offsets, at, marks} = this;
    for (let i = 0; i < at.length; ++i) {
      const {vertex} = marks[Math.floor(i / 3)];
      at[i] = offsets[i] + (vertex < 0 ? 0 : points[3 * vertex + i % 3]);
    }
    return at;
  }
}
