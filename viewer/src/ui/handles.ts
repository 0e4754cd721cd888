// Handles in the picture: what the pointer holds goes where the pointer goes, as far as its controls let it. The program finds the controls'
// values (docs/viewer-data.md, "Evaluate"); here is what is held, and on which line through the picture.
import {Vector3} from 'three';
import type {Context} from '../context';
import type {HandleInfo} from '../data/meta';
import type {Values} from '../live/client';
import {toPixels} from '../view/geometry';
import {h, onceAFrame} from './dom';
import {number} from './format';

interface Held {
  handle: number;
  pointer: number;
  /** From the pointer to the handle, in pixels: what is taken hold of does not jump. */
  aside: {x: number; y: number};
  began: {x: number; y: number};
  before: Values;
  gesture: string;
  dragged: boolean;
}

const near = {mouse: 10, touch: 20}, clickSlack = 3;  // pixels

export function listenToHandles(context: Context, stage: HTMLElement): void {
  const {store, model, viewport, view, session, scope} = context, {canvas, camera} = viewport, handles = model.meta.handles ?? [];
  if (!session || !handles.length) return;
  const label = canvas.getAttribute('aria-label') ?? '';
  canvas.setAttribute('aria-label', `${label} Handles are dragged; the sliders of the panel Controls do the same.`);
  const hint = h('div', {class: 'hint', attributes: {hidden: true}});
  stage.append(hint);
  let held: Held | null = null, hovered = -1, gestures = 0, pointerAt = {x: 0, y: 0};

  const pixelsOf = (handle: number): {x: number; y: number} | null =>
    toPixels(new Vector3(...view.handles.offsetOf(handle)), camera, canvas.clientWidth, canvas.clientHeight);

  const handleAt = ({x, y}: {x: number; y: number}, reach: number): number => {
    let nearest = reach, found = -1;
    if (!store.now.showHandles) return found;
    for (let i = 0; i < handles.length; ++i) {
      const at = pixelsOf(i), distance = at ? Math.hypot(at.x - x, at.y - y) : Infinity;
      if (distance < nearest) {
        nearest = distance;
        found = i;
      }
    }
    return found;
  };

  const placeIn = (event: MouseEvent): {x: number; y: number} => {
    const box = canvas.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  };
  const reachOf = (event: MouseEvent): number => event instanceof PointerEvent && event.pointerType === 'touch' ? near.touch : near.mouse;

  const show = onceAFrame(() => {
    const shown = held?.handle ?? hovered;
    view.showHandles(store.now.showHandles, shown >= 0 ? shown : store.now.handle);
    canvas.style.cursor = held ? 'grabbing' : hovered >= 0 ? 'grab' : '';
    stage.classList.toggle('over-handle', shown >= 0);
    hint.hidden = shown < 0;
    if (shown < 0) return;
    hint.textContent = describe(context, handles[shown]);
    hint.style.left = `${Math.max(4, Math.min(pointerAt.x + 14, stage.clientWidth - hint.offsetWidth - 4))}px`;
    hint.style.top = `${Math.max(4, Math.min(pointerAt.y + 14, stage.clientHeight - hint.offsetHeight - 4))}px`;
  });

  const letGo = (): void => {
    if (held && canvas.hasPointerCapture(held.pointer)) canvas.releasePointerCapture(held.pointer);
    held = null;
    show();
  };

  // before the camera and the vertices take them: the picture's own listeners are on the canvas
  const down = (event: PointerEvent): void => {
    if (held || event.target !== canvas || event.button !== 0 || event.shiftKey || event.ctrlKey) return;
    const at = placeIn(event), handle = handleAt(at, reachOf(event)), place = handle < 0 ? null : pixelsOf(handle);
    if (!place) return;
    event.stopPropagation();
    event.preventDefault();
    canvas.focus({preventScroll: true});
    canvas.setPointerCapture(event.pointerId);
    held = {handle, pointer: event.pointerId, aside: {x: place.x - at.x, y: place.y - at.y}, began: at, before: session.moved, gesture: `drag ${++gestures}`, dragged: false};
    pointerAt = at;
    store.set({handle});
    show();
  };

  const move = (event: PointerEvent): void => {
    const at = placeIn(event);
    if (!held) {
      const over = event.target === canvas && !event.buttons ? handleAt(at, reachOf(event)) : -1;
      if (over < 0 && hovered < 0) return;
      hovered = over;
      pointerAt = at;
      return show();
    }
    if (event.pointerId !== held.pointer) return;
    event.stopPropagation();
    pointerAt = at;
    if (!held.dragged && Math.hypot(at.x - held.began.x, at.y - held.began.y) <= clickSlack) return;
    if (!held.dragged) store.set({playing: false});
    held.dragged = true;
    const from = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    const x = (at.x + held.aside.x) / canvas.clientWidth * 2 - 1, y = 1 - (at.y + held.aside.y) / canvas.clientHeight * 2;
    const along = new Vector3(x, y, 0.5).unproject(camera).sub(from).normalize();
    session.dragTo({handle: held.handle, from: from.toArray(), along: along.toArray()}, held.gesture, event.timeStamp);
    show();
  };

  const up = (event: PointerEvent): void => {
    if (!held || event.pointerId !== held.pointer) return;
    event.stopPropagation();
    if (!held.dragged) context.open('controls');
    hovered = held.handle;
    letGo();
  };
  const lost = (event: PointerEvent): void => { if (held && event.pointerId === held.pointer) letGo(); };
  const leave = (): void => {
    hovered = -1;
    show();
  };
  const twice = (event: MouseEvent): void => {
    const handle = event.target === canvas ? handleAt(placeIn(event), reachOf(event)) : -1;
    if (handle >= 0) session.release(handles[handle].controls, event.timeStamp);
  };
  const press = (event: KeyboardEvent): void => {
    if (!held || event.key !== 'Escape') return;
    event.stopPropagation();
    event.preventDefault();
    session.takeBack(held.gesture, held.before);
    letGo();
  };

  stage.addEventListener('pointerdown', down, true);
  stage.addEventListener('pointermove', move, true);
  stage.addEventListener('pointerup', up, true);
  stage.addEventListener('pointercancel', lost, true);
  stage.addEventListener('lostpointercapture', lost, true);
  canvas.addEventListener('pointerleave', leave);
  stage.addEventListener('dblclick', twice, true);
  document.addEventListener('keydown', press, true);
  scope.add(() => {
    letGo();
    stage.removeEventListener('pointerdown', down, true);
    stage.removeEventListener('pointermove', move, true);
    stage.removeEventListener('pointerup', up, true);
    stage.removeEventListener('pointercancel', lost, true);
    stage.removeEventListener('lostpointercapture', lost, true);
    canvas.removeEventListener('pointerleave', leave);
    stage.removeEventListener('dblclick', twice, true);
    document.removeEventListener('keydown', press, true);
    canvas.setAttribute('aria-label', label);
    stage.classList.remove('over-handle');
    canvas.style.cursor = '';
    hint.remove();
  });
  scope.add(store.on(['showHandles', 'handle'], show));
  scope.add(session.places.on((places) => {
    view.handles.move(places);
    if (held || hovered >= 0) show();
  }));
}

function describe({model, session}: Context, {name, kind, controls}: HandleInfo): string {
  const told = controls.map((control) => {
    const info = model.meta.controls?.find((one) => one.name === control);
    const value = session!.moved[control] ?? session!.values.value[control] ?? info?.value;
    return `${info?.label ?? control} ${value === null || value === undefined ? '-' : number(value)}${info?.unit ? (info.unit === '°' ? '°' : ` ${info.unit}`) : ''}`;
  });
  return `${kind === 'turn' ? 'Turn' : 'Move'} ${name}: ${told.join(', ')}`;
}
