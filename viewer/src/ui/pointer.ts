// Clicks and hovers in the picture: vertices and cues.
import type {Context} from '../context';
import {toPixels, vertexUnder} from '../view/geometry';
import {describeCue} from './cues_panel';
import {h, onceAFrame} from './dom';

export function listenToPointer(context: Context, stage: HTMLElement): void {
  const {store, model, viewport, view, scope} = context, {canvas} = viewport;
  const hint = h('div', {class: 'hint cue-hint', attributes: {hidden: true}});
  stage.append(hint);
  let downAt: {x: number; y: number} | null = null, over: {x: number; y: number} | null = null;

  const cueAt = (x: number, y: number): number => {
    if (!store.now.showCues) return -1;
    let nearest = 10, found = -1;
    for (let i = 0; i < view.cueCount; ++i) {
      const at = toPixels(view.cuePlace(i), viewport.camera, canvas.clientWidth, canvas.clientHeight);
      const distance = at ? Math.hypot(at.x - x, at.y - y) : Infinity;
      if (distance < nearest) {
        nearest = distance;
        found = i;
      }
    }
    return found < 0 ? -1 : view.cueOf[found];
  };

  const hover = onceAFrame(() => {
    const cue = over ? cueAt(over.x, over.y) : -1;
    hint.hidden = cue < 0;
    if (cue < 0 || !over) return;
    hint.textContent = `${model.meta.cues![cue].name}: ${describeCue(context, cue)}`;
    hint.style.left = `${Math.max(4, Math.min(over.x + 14, stage.clientWidth - hint.offsetWidth - 4))}px`;
    hint.style.top = `${Math.max(4, Math.min(over.y + 14, stage.clientHeight - hint.offsetHeight - 4))}px`;
  });

  const down = (event: PointerEvent): void => { downAt = {x: event.offsetX, y: event.offsetY}; };
  const move = (event: PointerEvent): void => {
    over = event.buttons ? null : {x: event.offsetX, y: event.offsetY};
    if (view.cueCount) hover();
  };
  const leave = (): void => {
    over = null;
    hover();
  };
  const up = (event: PointerEvent): void => {
    if (!downAt || event.button !== 0 || Math.hypot(event.offsetX - downAt.x, event.offsetY - downAt.y) > 4) return;
    const {offsetX: x, offsetY: y} = event, cue = cueAt(x, y);
    if (cue >= 0) {
      store.set({cue});
      return context.open('cues');
    }
    const vertex = vertexUnder(model, view.shownPoints(), viewport.camera, x / canvas.clientWidth * 2 - 1, 1 - y / canvas.clientHeight * 2);
    const {picking, picked} = store.now;
    if (picking && vertex >= 0) store.set({vertex, picked: picked.includes(vertex) ? picked.filter((v) => v !== vertex) : [...picked, vertex]});
    else store.set({vertex});
    if (vertex >= 0) context.open('vertex');
  };
  canvas.addEventListener('pointerdown', down);
  canvas.addEventListener('pointermove', move);
  canvas.addEventListener('pointerleave', leave);
  canvas.addEventListener('pointerup', up);
  scope.add(() => {
    canvas.removeEventListener('pointerdown', down);
    canvas.removeEventListener('pointermove', move);
    canvas.removeEventListener('pointerleave', leave);
    canvas.removeEventListener('pointerup', up);
    hint.remove();
  });
  scope.add(store.on(['vertex', 'picked'], ({vertex, picked}) => view.setPicked(picked, vertex)));
}
