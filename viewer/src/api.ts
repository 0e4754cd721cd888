// window.kpsa: what tests and scripts see of the page.
import type {App} from './app';
import type {Loop} from './live/session';
import type {Side} from './shape/positions';
import {viewModes, type State, type ViewMode} from './state';

export interface Api {
  /** Resolves when the first picture is drawn. */
  ready: Promise<void>;
  readonly state: Readonly<State> & {clipName: string | null; generation: number | null};
  readonly facts: object;
  setFrame(frame: number, clip?: string | null): Promise<void>;
  setMode(mode: ViewMode): Promise<void>;
  /** Live: moves a control; resolves when the picture that has it is drawn. */
  setControl(name: string, value: number): Promise<void>;
  /** x y z of each vertex, metres, as they are drawn. */
  positions(side?: Side): Float32Array;
  /** Where a vertex is in the page, in CSS pixels. */
  project(vertex: number): {x: number; y: number};
  /** Where a handle is in the page, in CSS pixels. */
  projectHandle(handle: number): {x: number; y: number};
  readonly loopMs: number | null;
  /** What draws: a GPU, or the processor. */
  readonly renderer: string;
  /** Live: moves a control to one value after the other, one at each refresh of the screen, as a hand does, and again until there are
      pictures for a quarter of them; the pictures that were drawn.
      Each of them is marked (performance.mark) as "kpsa picture". */
  timeControl(name: string, values: readonly number[]): Promise<Loop[]>;
  /** Shows frames one after the other: the page's own work of each (state, texts, layout), and until the picture was drawn; milliseconds. */
  timeFrames(frames: readonly number[]): {page: number[]; picture: number[]};
  readonly errors: string[];
}

const nextPicture = (): Promise<void> => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => resolve())));

export function makeApi(app: () => App | null, ready: Promise<void>, errors: string[]): Api {
  const now = (): NonNullable<App['context']> => {
    const context = app()?.context;
    if (!context) throw new Error('the page is not ready');
    return context;
  };
  const settled = async (): Promise<void> => {
    const {session} = now();
    while (session && !session.idle) await new Promise((resolve) => setTimeout(resolve, 2));
    await nextPicture();
  };
  return {
    ready, errors,
    get state() {
      const {store, model} = now(), {clip} = store.now;
      return {...store.now, clipName: clip >= 0 ? model.meta.clips![clip].name : null, generation: model.meta.generation ?? null};
    },
    get facts() {
      return now().facts.value;
    },
    async setFrame(frame, clip) {
      const {store, model} = now();
      const index = clip === undefined ? store.now.clip : (model.meta.clips ?? []).findIndex((c) => c.name === clip);
      store.set({playing: false, clip: index, frame});
      await settled();
    },
    async setMode(mode) {
      if (!viewModes.includes(mode)) throw new Error(`no mode ${String(mode)}`);
      now().store.set({mode});
      await settled();
    },
    async setControl(name, value) {
      const {session} = now();
      if (!session) throw new Error('a report has no controls to set');
      session.set({[name]: value});
      await settled();
    },
    positions(side = 'accelerated') {
      return now().viewport.points(side).slice();
    },
    project(vertex) {
      const {viewport, view} = now(), box = viewport.canvas.getBoundingClientRect();
      const at = viewport.pixelsOf(view.shownPoints(), vertex);
      return {x: box.left + at.x, y: box.top + at.y};
    },
    projectHandle(handle) {
      const {viewport, view} = now(), box = viewport.canvas.getBoundingClientRect();
      const at = viewport.pixelsOf(Float32Array.from(view.handles.offsetOf(handle)), 0);
      return {x: box.left + at.x, y: box.top + at.y};
    },
    get loopMs() {
      return app()?.context?.session?.loopMs.value ?? null;
    },
    get renderer() {
      return now().viewport.picture.name;
    },
    async timeControl(name, values) {
      const {session} = now(), loops: Loop[] = [];
      if (!session) throw new Error('a report has no controls to set');
      const before = session.drawn.value, end = session.drawn.on((loop) => {
        if (!loop || loop === before) return;
        performance.mark('kpsa picture');
        loops.push(loop);
      });
      for (let i = 0; i < values.length || loops.length < values.length / 4; ++i) {
        await new Promise((resolve) => requestAnimationFrame(resolve));
        session.set({[name]: values[i % values.length]});
      }
      await settled();
      end();
      return loops;
    },
    timeFrames(frames) {
      const {store, viewport} = now(), page: number[] = [], picture: number[] = [];
      viewport.picture.wait();
      for (const frame of frames) {
        const begin = performance.now();
        store.set({playing: false, frame});
        document.body.getBoundingClientRect();  // styles and layout of what has changed
        const told = performance.now();
        viewport.draw();
        viewport.picture.wait();
        page.push(told - begin);
        picture.push(performance.now() - told);
      }
      return {page, picture};
    },
  };
}
