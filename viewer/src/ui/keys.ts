// Keys of the whole page. Fields and sliders keep theirs.
import {Vector3} from 'three';
import type {Context} from '../context';
import {chooseClip, framesOf, step} from '../player';
import {viewModes} from '../state';
import type {Help} from './help';
import {applyTheme, theme} from './theme';

function typing(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement && target.type === 'range') return /^(Arrow|Home|End|Page)/.test(key);
  if (target instanceof HTMLInputElement && target.type === 'checkbox') return key === ' ';
  if (target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement) return true;
  if (target.closest('[role=tab], [role=separator], .table-place, summary') && /^(Arrow|Home|End| )/.test(key)) return true;
  return key === ' ' && target.closest('button, a') !== null;
}

export function listenToKeys({store, model, viewport, view, scope, session, tell}: Context, help: Help): void {
  const clips = model.meta.clips?.length ?? 0, turn = Math.PI / 24;
  const press = (event: KeyboardEvent): void => {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;  // Caps Lock
    if (typing(event.target, key) || event.altKey || event.metaKey || (help.element.open && key !== '?')) return;
    const {clip} = store.now;
    if (event.ctrlKey && session && (key === 'z' || key === 'y')) {
      event.preventDefault();
      const back = key === 'z' && !event.shiftKey;
      if (!(back ? session.undo() : session.redo())) tell(back ? 'nothing to undo' : 'nothing to redo');
      return;
    }
    if (event.shiftKey && key.startsWith('Arrow')) {
      if (key === 'ArrowLeft' || key === 'ArrowRight') viewport.turn(key === 'ArrowLeft' ? -turn : turn, 0);
      else viewport.turn(0, key === 'ArrowUp' ? turn : -turn);
      return event.preventDefault();
    }
    const many = event.ctrlKey ? 10 : 1;
    if (event.ctrlKey && key !== 'ArrowLeft' && key !== 'ArrowRight') return;
    switch (key) {
      case ' ': if (framesOf(model, clip) > 1) store.set({playing: !store.now.playing}); break;
      case 'ArrowLeft': step(store, model, -many); break;
      case 'ArrowRight': step(store, model, many); break;
      case 'Home': store.set({playing: false, frame: 0}); break;
      case 'End': store.set({playing: false, frame: Math.max(0, framesOf(model, clip) - 1)}); break;
      case '[': if (clip > 0) chooseClip(store, model, clip - 1); break;
      case ']': if (clip + 1 < clips) chooseClip(store, model, clip + 1); break;
      case 'l': store.set({loop: !store.now.loop}); break;
      case '1': case '2': case '3': case '4': if (model.accelerated) store.set({mode: viewModes[Number(key) - 1]}); break;
      case 'f': viewport.fit(); break;
      case 'x': viewport.fit(new Vector3(1, 0, 0)); break;
      case 'y': viewport.fit(new Vector3(0, 1, 0.001)); break;
      case 'z': viewport.fit(new Vector3(0, 0, 1)); break;
      case '+': case '=': viewport.zoom(0.85); break;
      case '-': viewport.zoom(1 / 0.85); break;
      case 'c': if (view.cueCount) store.set({showCues: !store.now.showCues}); break;
      case 'e': store.set({showEdges: !store.now.showEdges}); break;
      case 'h': if (model.meta.handles?.length) store.set({showHandles: !store.now.showHandles}); break;
      case 'p': store.set({picking: !store.now.picking}); break;
      case 't': applyTheme(theme() === 'dark' ? 'light' : 'dark'); break;
      case 'Escape': store.set({vertex: -1, cue: -1, node: -1, paint: null, handle: -1, picking: false}); break;
      case '?': help.toggle(); break;
      default: return;
    }
    event.preventDefault();
  };
  document.addEventListener('keydown', press);
  scope.add(() => document.removeEventListener('keydown', press));
}
