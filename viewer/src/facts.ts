// What is known of the frame that is shown, and of all frames of a clip: from the report, or as the live server tells it.
import type {Meta, Numbers} from './data/meta';
import {verdictNames, type Verdict} from './view/colours';

export interface Facts {
  verdict: Verdict | null;
  reason: string | null;
  score: number | null;
  full_us: number | null;
  accelerated_us: number | null;
  max_error: number | null;
  rms_error: number | null;
  /** The difference of this frame is not in the report. */
  unknown: boolean;
  problem: string | null;
}

export const noFacts: Facts = {
  verdict: null, reason: null, score: null, full_us: null, accelerated_us: null, max_error: null, rms_error: null, unknown: false, problem: null,
};

const numbers = (values: Numbers | null | undefined, frames: number): (number | null)[] =>
  Array.from({length: frames}, (_, i) => values?.[i] ?? null);

/** A clip's frames; live, they are filled in as they are seen. */
export class Series {
  readonly verdicts: (Verdict | null)[];
  readonly reasons: (string | null)[];
  readonly scores: (number | null)[];
  readonly full_us: (number | null)[];
  readonly accelerated_us: (number | null)[];
  readonly max_error: (number | null)[];
  readonly rms_error: (number | null)[];

  constructor(meta: Meta, readonly clip: number) {
    const info = meta.clips![clip], frames = info.frames;
    this.verdicts = numbers(info.verdicts, frames).map((v) => v === null ? null : verdictNames[v] ?? null);
    this.reasons = numbers(info.reasons, frames).map((r) => r === null || r < 0 ? null : meta.reasons?.[r] ?? null);
    this.scores = numbers(info.scores, frames);
    this.full_us = numbers(info.full_us, frames);
    this.accelerated_us = numbers(info.accelerated_us, frames);
    this.max_error = numbers(info.max_error, frames);
    this.rms_error = numbers(info.rms_error, frames);
  }

  at(frame: number): Facts {
    return {
      verdict: this.verdicts[frame] ?? null, reason: this.reasons[frame] ?? null, score: this.scores[frame] ?? null,
      full_us: this.full_us[frame] ?? null, accelerated_us: this.accelerated_us[frame] ?? null,
      max_error: this.max_error[frame] ?? null, rms_error: this.rms_error[frame] ?? null, unknown: false, problem: null,
    };
  }

  record(frame: number, facts: Facts): void {
    this.verdicts[frame] = facts.verdict ?? this.verdicts[frame];
    this.reasons[frame] = facts.verdict ? facts.reason : this.reasons[frame];
    this.scores[frame] = facts.score ?? this.scores[frame];
    this.full_us[frame] = facts.full_us ?? this.full_us[frame];
    this.accelerated_us[frame] = facts.accelerated_us ?? this.accelerated_us[frame];
    this.max_error[frame] = facts.max_error ?? this.max_error[frame];
    this.rms_error[frame] = facts.rms_error ?? this.rms_error[frame];
  }

  has(what: 'verdicts' | 'full_us' | 'accelerated_us' | 'max_error' | 'rms_error'): boolean {
    return this[what].some((value) => value !== null);
  }
}

/** One value that changes, and who listens to it. */
export class Signal<T> {
  private readonly calls = new Set<(value: T) => void>();
  constructor(public value: T) {}
  set(value: T): void {
    this.value = value;
    for (const call of [...this.calls]) call(value);
  }
  on(call: (value: T) => void): () => void {
    this.calls.add(call);
    call(this.value);
    return () => this.calls.delete(call);
  }
}
