// What is shown, in one place; whoever changes it calls set(), whoever shows it listens.

export type ViewMode = 'full' | 'accelerated' | 'difference' | 'overlay';
export const viewModes: readonly ViewMode[] = ['full', 'accelerated', 'difference', 'overlay'];

/** What colours the surface instead of the mesh's own colour. */
export type Paint = {kind: 'field'; name: string} | {kind: 'moves'; name: string} | null;

export interface State {
  clip: number;    // -1: no clip, the rest pose (and the sliders, live)
  frame: number;
  mode: ViewMode;
  playing: boolean;
  loop: boolean;
  paint: Paint;
  vertex: number;  // the selected one, -1 for none
  cue: number;     // -1 for none
  node: number;    // -1 for none
  picking: boolean;
  picked: readonly number[];
  errorTop: number;  // of the heat map, metres
  showCues: boolean;
  showEdges: boolean;
  showHandles: boolean;
  handle: number;  // the one that is held or hovered, or whose sliders are; -1 for none
}

export const initialState: State = {
  clip: -1, frame: 0, mode: 'full', playing: false, loop: true, paint: null, vertex: -1, cue: -1, node: -1, picking: false, picked: [],
  errorTop: 0.001, showCues: false, showEdges: false,
  showHandles: true, handle: -1,
};

type Listener = (state: State) => void;

export class Store {
  private state: State = {...initialState};
  private readonly listeners = new Set<{keys: readonly (keyof State)[]; call: Listener}>();

  get now(): Readonly<State> {
    return this.state;
  }

  set(change: Partial<State>): void {
    const changed = (Object.keys(change) as (keyof State)[]).filter((key) => change[key] !== this.state[key]);
    if (!changed.length) return;
    this.state = {...this.state, ...change};
    for (const listener of [...this.listeners]) {
      if (listener.keys.some((key) => changed.includes(key))) listener.call(this.state);
    }
  }

  /** Calls now, and whenever one of `keys` changes; the result ends that. */
  on(keys: readonly (keyof State)[], call: Listener): () => void {
    const listener = {keys, call};
    this.listeners.add(listener);
    call(this.state);
    return () => this.listeners.delete(listener);
  }
}

/** Things to undo when a rig is replaced by another version. */
export class Scope {
  private readonly ends: (() => void)[] = [];
  add(end: () => void): void {
    this.ends.push(end);
  }
  end(): void {
    for (const end of this.ends.splice(0)) end();
  }
}
