// Reset, and poses as files.
import type {Context} from '../context';
import {nearestFrame} from '../player';
import {button, h} from './dom';

export function makePoseRow({session, store, model, tell, scope}: Context): HTMLElement {
  const live = session!;
  const open = h('input', {
    attributes: {type: 'file', accept: '.json,.yaml,.yml,.txt', hidden: true, 'aria-label': 'Pose file'},
    on: {change: () => {
      const file = open.files?.[0];
      open.value = '';
      if (!file) return;
      file.text().then((text) => live.client.poseFile(text)).then(({set, clip: name, time}) => {
        const clip = (model.meta.clips ?? []).findIndex((c) => c.name === name);
        if (clip >= 0) store.set({playing: false, clip, frame: nearestFrame(model, clip, time ?? model.meta.clips![clip].begin)});
        live.set(set);
        tell(`${file.name}: ${Object.keys(set).length} values${clip >= 0 ? `, ${name} at frame ${store.now.frame}` : ''}`);
      }).catch((error: Error) => tell(error.message));
    }},
  });
  const compare = h('input', {attributes: {type: 'checkbox', checked: live.compare}, on: {change: () => {
    live.compare = compare.checked;
    live.changed();
  }}});
  const undo = button('Undo', () => live.undo(), {title: 'What was moved last (Ctrl+Z)'});
  const redo = button('Redo', () => live.redo(), {title: 'What was undone last (Ctrl+Shift+Z)'});
  scope.add(live.touched.on(() => {
    undo.disabled = !live.history.canUndo;
    redo.disabled = !live.history.canRedo;
  }));
  return h('div', {class: 'row pose'},
    undo, redo,
    button('Reset', (() => live.release(Object.keys(live.moved))), {title: 'All controls as the rig or the clip has them'}),
    button('Save pose', () => {
      const values: Record<string, number> = {};
      for (const {name, value} of model.meta.controls ?? []) {
        const now = live.moved[name] ?? live.values.value[name] ?? value;
        if (now !== null && now !== undefined) values[name] = now;
      }
      const link = h('a', {attributes: {href: URL.createObjectURL(new Blob([JSON.stringify(values, null, 2) + '\n'], {type: 'application/json'})), download: 'pose.json'}});
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }),
    button('Load pose', () => open.click()), open,
    model.accelerated ? h('label', {class: 'check', attributes: {title: 'Evaluates fully as well, so that the error is known'}}, compare, ' Compare') : null);
}
