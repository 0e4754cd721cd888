// Evaluation on the server: one request in flight, the newest state wins, and how long the whole loop takes.
import type {Model} from '../data/model';
import {noFacts, Signal, type Facts, type Series} from '../facts';
import type {Store} from '../state';
import type {Viewport} from '../view/viewport';
import type {Client, DragRequest, EvaluateAnswer, EvaluateMode, Values} from './client';
import {History} from './history';

/** A picture and how it came about: when its change was asked for (a time of the page), and what each part took; milliseconds. */
export interface Loop {
  asked: number;
  program: number;  // evaluation
  answer: number;   // until the answer was in the page
  page: number;     // state, texts and panels
  picture: number;  // until the picture was drawn
}

export class Session {
  /** What the user has moved; everything else is as in the clip or as the rig sets it. */
  moved: Values = {};
  /** Controls as the server evaluated them last. */
  readonly values = new Signal<Values>({});
  /** Something was moved or released. */
  readonly touched = new Signal<number>(0);
  readonly loopMs = new Signal<number | null>(null);
  /** The latest picture; whoever listens hears of each when it is drawn. */
  readonly drawn = new Signal<Loop | null>(null);
  /** x y z of each handle, as they were evaluated last. */
  readonly places = new Signal<readonly (number | null)[]>([]);
  /** Whether both sides are asked for, so that the error is known. */
  compare = true;
  answered = 0;
  private id = 0;
  private busy = false;
  private again = false;
  private asked = 0;      // when the oldest change was made that is not drawn yet
  private waiting = 0;
  private ended = false;
  readonly history = new History();
  private drag: {to: DragRequest; gesture: string} | null = null;
  private drags = 0;  // a later set, release or cancel wins over the answer to a drag

  constructor(
    readonly client: Client, private readonly model: Model, private readonly store: Store, private readonly viewport: Viewport,
    private readonly facts: Signal<Facts>, private readonly series: readonly Series[], private readonly tell: (text: string) => void,
  ) {}

  /** Brings a handle to the pointer; all of one gesture are one step to undo. */
  dragTo(to: DragRequest, gesture: string, at = performance.now()): void {
    this.drag = {to, gesture};
    this.changed(at);
  }

  /** As if the gesture had not been. */
  takeBack(gesture: string, before: Values): void {
    this.history.drop(gesture);
    this.restore(before);
  }

  undo(): boolean {
    return this.goTo(this.history.undo(this.moved));
  }

  redo(): boolean {
    return this.goTo(this.history.redo(this.moved));
  }

  private goTo(moved: Values | null): boolean {
    if (moved) this.restore(moved);
    return moved !== null;
  }

  private restore(moved: Values, at = performance.now()): void {
    this.drag = null;
    ++this.drags;
    this.moved = moved;
    this.touched.set(this.touched.value + 1);
    this.changed(at);
  }

  set(values: Values, at = performance.now()): void {
    this.history.note(this.moved, Object.keys(values).join(), at, false);
    this.restore({...this.moved, ...values}, at);
  }

  release(names: readonly string[], at = performance.now()): void {
    const rest = {...this.moved};
    for (const name of names) delete rest[name];
    if (Object.keys(rest).length === Object.keys(this.moved).length) return;
    this.history.note(this.moved, 'release ' + names.join(), at, false);
    this.restore(rest, at);
  }

  /** Something that is evaluated has changed. */
  changed(at = performance.now()): void {
    if (this.ended) return;
    if (!this.waiting) this.waiting = at;
    if (this.busy) this.again = true;
    else void this.run();
  }

  end(): void {
    this.ended = true;
  }

  get idle(): boolean {
    return !this.busy && !this.again;
  }

  private mode(): EvaluateMode {
    if (!this.model.accelerated) return 'full';
    const mode = this.store.now.mode;
    return this.compare || mode === 'difference' || mode === 'overlay' ? 'both' : mode;
  }

  private async run(): Promise<void> {
    this.busy = true;
    do {
      this.again = false;
      this.asked = this.waiting;
      this.waiting = 0;
      const {clip, frame, showHandles} = this.store.now;
      // a place of the pointer is gone to once
      const {drag, drags} = this;
      this.drag = null;
      const set = this.moved, info = clip >= 0 ? this.model.meta.clips![clip] : null;
      const sent = performance.now();
      try {
        const answer = await this.client.evaluate({
          id: ++this.id, set, clip: info?.name ?? null, time: info ? info.begin + frame / info.fps : 0, mode: this.mode(),
          ...this.model.meta.handles?.length && showHandles ? {handles: true} : {}, ...drag ? {drag: drag.to} : {},
        }, this.model.points);
        if (this.ended) break;
        const took = performance.now() - sent;
        const {dragged} = answer.facts;
        if (dragged && drag && drags === this.drags) {
          this.history.note(this.moved, drag.gesture, performance.now(), true);
          this.moved = {...this.moved, ...dragged};
          this.touched.set(this.touched.value + 1);
        }
        await this.show(answer, took, clip, frame, !drag && !Object.keys(set).length);
      } catch (error) {
        if (this.ended) break;
        this.facts.set({...this.facts.value, problem: (error as Error).message});
        if (error instanceof TypeError) {
          this.tell('no answer from the server');
          await new Promise((resolve) => setTimeout(resolve, 500));
        }
      }
    } while (this.again && !this.ended);
    this.busy = false;
  }

  private async show({facts, accelerated, full}: EvaluateAnswer, took: number, clip: number, frame: number, ofClip: boolean): Promise<void> {
    if (facts.generation !== undefined && facts.generation !== (this.model.meta.generation ?? facts.generation)) return;
    const begin = performance.now();
    if (accelerated || full) this.viewport.view?.positions.setSent(accelerated, full);
    const known: Facts = {
      ...noFacts, verdict: facts.verdict ?? null, reason: facts.reason || null, score: facts.score ?? null, full_us: facts.full_us ?? null,
      accelerated_us: facts.accelerated_us ?? null, max_error: facts.max_error ?? null, rms_error: facts.rms_error ?? null, problem: facts.problem ?? null,
    };
    if (clip >= 0 && ofClip) this.series[clip]?.record(frame, known);
    this.facts.set(known);
    if (facts.values) this.values.set(facts.values);
    if (facts.handles) this.places.set(facts.handles);
    const told = performance.now();
    this.viewport.draw();
    await this.viewport.picture.finished();
    const end = performance.now(), program = ((facts.full_us ?? 0) + (facts.accelerated_us ?? 0)) / 1000;
    ++this.answered;
    if (this.asked) this.loopMs.set(end - this.asked);
    this.drawn.set({asked: this.asked, program, answer: took, page: told - begin, picture: end - told});
  }
}
