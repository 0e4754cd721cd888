// Plays a clip at its own speed, by the clock: slow machines skip frames.
import type {Store} from './state';
import type {Model} from './data/model';
import type {Scope} from './state';

export function framesOf(model: Model, clip: number): number {
  return clip >= 0 ? model.meta.clips?.[clip]?.frames ?? 0 : 0;
}

/** The frame of a clip that is nearest to a time in seconds. */
export function nearestFrame(model: Model, clip: number, time: number): number {
  const {begin, fps, frames} = model.meta.clips![clip];
  return Math.max(0, Math.min(frames - 1, Math.round((time - begin) * fps)));
}

export function play(store: Store, model: Model, scope: Scope): void {
  let began = 0, from = 0, waiting = 0;
  const tick = (now: number): void => {
    waiting = 0;
    if (!store.now.playing) return;
    const {clip, loop} = store.now, frames = framesOf(model, clip);
    if (frames < 2) return store.set({playing: false});
    // the time of a picture may be before the moment when playing began
    let frame = from + Math.floor(Math.max(0, now - began) / 1000 * model.meta.clips![clip].fps);
    if (frame >= frames && !loop) return store.set({frame: frames - 1, playing: false});
    // rounds are taken off, or the end of looping would be far beyond the clip
    const rounds = Math.floor(frame / frames) * frames;
    from -= rounds;
    frame -= rounds;
    store.set({frame});
    if (store.now.playing && !waiting) waiting = requestAnimationFrame(tick);
  };
  const stop = (): void => {
    cancelAnimationFrame(waiting);
    waiting = 0;
  };
  scope.add(store.on(['playing', 'clip'], ({playing, frame, clip}) => {
    stop();
    if (!playing) return;
    from = frame >= framesOf(model, clip) - 1 ? 0 : frame;
    began = performance.now();
    waiting = requestAnimationFrame(tick);
  }));
  scope.add(stop);
}

/** Goes some frames on or back, round the ends. */
export function step(store: Store, model: Model, by: number): void {
  const {clip, frame} = store.now, frames = framesOf(model, clip);
  if (frames) store.set({playing: false, frame: ((frame + by) % frames + frames) % frames});
}

export function chooseClip(store: Store, model: Model, clip: number): void {
  store.set({clip, frame: Math.min(store.now.frame, Math.max(0, framesOf(model, clip) - 1)), ...clip < 0 ? {playing: false} : {}});
}
