// Plays a clip at its own speed, by the clock: slow machines skip frames.
import type {Store} from './state';
import type {Model} from './data/model';
import type {Scope} from './state';

export function framesOf(model: Model, clip: number): number {
  return clip >= 0 ? model.meta.clips?.[clip]?.frames ?? 0 : 0;
}

export function play(store: Store, model: Model, scope: Scope): void {
  let began = 0, from = 0, running = false, ended = false;
  const tick = (now: number): void => {
    if (ended || !store.now.playing) {
      running = false;
      return;
    }
    const {clip, loop} = store.now, frames = framesOf(model, clip);
    if (frames < 2) return store.set({playing: false});
    const fps = model.meta.clips![clip].fps || 24;
    let frame = from + Math.floor((now - began) / 1000 * fps);
    if (frame >= frames && !loop) return store.set({frame: frames - 1, playing: false});
    frame %= frames;
    store.set({frame});
    requestAnimationFrame(tick);
  };
  scope.add(store.on(['playing', 'clip'], ({playing, frame, clip}) => {
    if (!playing) {
      running = false;
      return;
    }
    from = frame >= framesOf(model, clip) - 1 ? 0 : frame;
    began = performance.now();
    if (!running) requestAnimationFrame(tick);
    running = true;
  }));
  scope.add(() => { ended = true; });
}

/** Goes some frames on or back, round the ends. */
export function step(store: Store, model: Model, by: number): void {
  const {clip, frame} = store.now, frames = framesOf(model, clip);
  if (frames) store.set({playing: false, frame: ((frame + by) % frames + frames) % frames});
}

export function chooseClip(store: Store, model: Model, clip: number): void {
  store.set({clip, frame: Math.min(store.now.frame, Math.max(0, framesOf(model, clip) - 1)), ...clip < 0 ? {playing: false} : {}});
}
