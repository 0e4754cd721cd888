// Buttons over the picture: what is shown, what colours it, marks, fit.
import type {Context} from '../context';
import {viewModes, type Paint, type ViewMode} from '../state';
import {button, h, setPressed} from './dom';

const names: Record<ViewMode, string> = {full: 'Full', accelerated: 'Accelerated', difference: 'Difference', overlay: 'Overlay'};

export function makeToolbar(context: Context): HTMLElement {
  const {store, model, view, viewport, scope, session} = context;
  const bar = h('div', {class: 'toolbar', attributes: {role: 'toolbar', 'aria-label': 'Picture'}});

  if (model.accelerated) {
    const modes = viewModes.map((mode, i) => {
      const made = button(names[mode], () => store.set({mode}), {title: `${names[mode]} (${i + 1})`, pressed: false});
      made.dataset.mode = mode;
      return made;
    });
    bar.append(h('div', {class: 'group', attributes: {role: 'group', 'aria-label': 'Shown'}}, ...modes));
    scope.add(store.on(['mode'], ({mode}) => {
      view.setMode(mode);
      for (const made of modes) setPressed(made, made.dataset.mode === mode);
    }));
  } else {
    view.setMode('full');
  }

  const paints = paintChoice(context);
  if (paints) bar.append(paints);

  const group = h('div', {class: 'group'});
  if (view.cueCount) {
    const cues = button('Cues', () => store.set({showCues: !store.now.showCues}), {title: 'What is measured (C)', pressed: false});
    scope.add(store.on(['showCues', 'cue'], ({showCues, cue}) => {
      setPressed(cues, showCues);
      view.showCues(showCues, cue);
    }));
    group.append(cues);
  }
  if (model.meta.handles?.length) {
    const handles = button('Handles', () => store.set({showHandles: !store.now.showHandles}), {title: 'What is dragged (H)', pressed: true});
    scope.add(store.on(['showHandles'], ({showHandles}) => {
      setPressed(handles, showHandles);
      if (showHandles) session?.changed();
    }));
    group.append(handles);
  }
  const edges = button('Edges', () => store.set({showEdges: !store.now.showEdges}),
    {title: view.edgesAreModelled ? 'Edges (E)' : 'Edges of the triangles that the file has (E)', pressed: false});
  scope.add(store.on(['showEdges'], ({showEdges}) => {
    setPressed(edges, showEdges);
    view.setEdges(showEdges);
  }));
  group.append(edges);
  group.append(button('Fit', () => viewport.fit(), {title: 'All of it (F)'}));
  bar.append(group);
  return bar;
}

/** What may colour the surface: fields, and what controls move. */
function paintChoice({store, model, scope, view, session, tell}: Context): HTMLElement | null {
  const controls = (model.meta.controls ?? []).filter((control) => control.moves);
  const fields = model.meta.fields ?? [];
  if (!controls.length && !fields.length) return null;
  const choice = h('select', {
    attributes: {'aria-label': 'Colours', title: 'What colours the surface'},
    on: {change: () => {
      const [kind, ...name] = choice.value.split(':');
      store.set({paint: kind ? {kind, name: name.join(':')} as Paint : null, ...kind && store.now.mode === 'difference' ? {mode: 'full' as const} : {}});
    }},
  }, h('option', {attributes: {value: ''}}, 'Plain colours'));
  const groups = new Map<string, HTMLOptGroupElement>();
  const add = (group: string, value: string, label: string): void => {
    if (!groups.has(group)) groups.set(group, choice.appendChild(h('optgroup', {attributes: {label: group}})));
    groups.get(group)!.append(h('option', {attributes: {value}}, label));
  };
  for (const field of fields) add(field.group ?? 'Fields', 'field:' + field.name, field.label ?? field.name);
  for (const control of controls) add('Moved by', 'moves:' + control.name, control.label ?? control.name);

  let wanted = 0;
  scope.add(store.on(['paint'], ({paint}) => {
    const mine = ++wanted;
    choice.value = paint ? `${paint.kind}:${paint.name}` : '';
    if (!paint) return view.setField(null, 1);
    const load = async (): Promise<void> => {
      const control = controls.find((c) => c.name === paint.name), field = fields.find((f) => f.name === paint.name);
      const blob = paint.kind === 'moves' ? control?.moves : field?.blob;
      const values = blob ? await model.blob(blob) : await session?.client.field(paint.name);
      if (mine === wanted && values) view.setField(values, values instanceof Uint8Array ? 1 / 255 : 1);
    };
    load().catch((error: Error) => tell(error.message));
  }));
  return choice;
}
