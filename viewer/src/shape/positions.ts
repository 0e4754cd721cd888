// Where all points are, accelerated and full: from the subspace and a residual (reports), or as they were sent (live). Computed when somebody
// asks for them, once for each change.
import type {Model, Shape} from '../data/model';

export type Side = 'accelerated' | 'full';

export class Positions {
  /** Counts changes of the points. */
  version = 0;
  private readonly accelerated: Float32Array;
  private readonly full: Float32Array;
  private readonly apart: Float32Array;
  private readonly known: Record<Side | 'errors', number> = {accelerated: -1, full: -1, errors: -1};  // the version that each of them is of
  private row = -1;
  private residual: {values: Int8Array | Int16Array; step: number} | null = null;
  private sent: Record<Side, Float32Array> | null = null;

  constructor(private readonly model: Model) {
    this.accelerated = model.rest.slice();
    this.full = new Float32Array(model.points * 3);
    this.apart = new Float32Array(model.points);
  }

  /** The row of the shape that is shown; -1 is rest. */
  setRow(row: number): void {
    this.row = row;
    ++this.version;
  }

  /** What the full points add, or nothing. */
  setResidual(values: Int8Array | Int16Array | null, step: number): void {
    this.residual = values ? {values, step} : null;
    ++this.version;
  }

  /** Points as a server sent them; where it sent one side only, both are that. */
  setSent(accelerated: Float32Array | null, full: Float32Array | null): void {
    const a = accelerated ?? full, f = full ?? accelerated;
    if (!a || !f) return;
    this.sent = {accelerated: a, full: f};
    ++this.version;
  }

  /** x y z of each point, metres. */
  of(side: Side): Float32Array {
    if (this.sent) return this.sent[side];
    const {shape, rest} = this.model;
    if (!shape) return rest;
    if (this.outdated('accelerated')) fromShape(shape, this.row, rest, this.accelerated);
    const {residual, accelerated, full} = this;
    if (side === 'accelerated' || !residual) return accelerated;
    if (this.outdated('full')) for (let i = 0; i < full.length; ++i) full[i] = accelerated[i] + residual.step * residual.values[i];
    return full;
  }

  /** How far both sides are apart at each point, metres. */
  errors(): Float32Array {
    const {apart} = this, a = this.of('accelerated'), f = this.of('full');
    if (!this.outdated('errors')) return apart;
    if (a === f) apart.fill(0);
    else {
      for (let v = 0, i = 0; v < apart.length; ++v, i += 3) {
        const x = f[i] - a[i], y = f[i + 1] - a[i + 1], z = f[i + 2] - a[i + 2];
        apart[v] = Math.sqrt(x * x + y * y + z * z);
      }
    }
    return apart;
  }

  private outdated(what: Side | 'errors'): boolean {
    const was = this.known[what];
    this.known[what] = this.version;
    return was !== this.version;
  }
}

/** The rest and its modes, as much of each as the row says. Four modes at a time: what is added up is read and written a quarter as often. */
function fromShape(shape: Shape, row: number, rest: Float32Array, out: Float32Array): void {
  const {info: {modes}, basis, scale, rows, steps} = shape, size = out.length;
  const share = (k: number): number => k < modes && row >= 0 ? rows[row * modes + k] * scale[k] / steps : 0;
  out.set(rest.subarray(0, size));
  for (let k = 0; k < modes && row >= 0; k += 4) {
    const a = share(k), b = share(k + 1), c = share(k + 2), d = share(k + 3);
    const of = (mode: number): Int8Array | Int16Array => basis.subarray(Math.min(mode, modes - 1) * size);
    const first = of(k), second = of(k + 1), third = of(k + 2), fourth = of(k + 3);
    for (let i = 0; i < size; ++i) out[i] += a * first[i] + b * second[i] + c * third[i] + d * fourth[i];
  }
}
