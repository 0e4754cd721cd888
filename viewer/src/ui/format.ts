// Numbers as people read them.
import type {Model} from '../data/model';

/** About three digits. */
export function number(value: number): string {
  if (!Number.isFinite(value)) return '-';
  const size = Math.abs(value);
  if (size === 0) return '0';
  if (size >= 1e6 || size < 9.9e-5) return value.toExponential(1);
  if (size >= 100) return Math.round(value).toLocaleString('en-US');
  return String(Number(value.toPrecision(3)));
}

/** Metres in the unit of the page. */
export function length(metres: number | null | undefined, model: Model): string {
  if (metres === null || metres === undefined) return '-';
  return `${number(metres / model.unit.metres)} ${model.unit.name}`;
}

/** Microseconds, as milliseconds from one on. */
export function duration(us: number | null | undefined): string {
  if (us === null || us === undefined) return '-';
  return us >= 1e6 ? `${number(us / 1e6)} s` : us >= 1000 ? `${number(us / 1000)} ms` : `${number(us)} µs`;
}

export function percent(share: number): string {
  return `${number(share * 100)} %`;
}
