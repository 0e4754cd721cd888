// Controls: sliders (live), or the list of what there is and what each moves (report).
import type {Context} from '../context';
import type {ControlInfo} from '../data/meta';
import {button, h, setPressed} from './dom';
import {number} from './format';
import {makePoseRow} from './pose_files';

interface Row {
  info: ControlInfo;
  show(value: number, moved: boolean): void;
  element: HTMLElement;
}

export function makeControls(context: Context): HTMLElement | null {
  const {model, session, scope, store} = context, controls = model.meta.controls ?? [];
  if (!controls.length) return null;
  const rows = controls.map((info) => session && info.min !== null && info.min !== undefined ? sliderRow(context, info) : plainRow(context, info));
  const groups = new Map<string, Row[]>();
  for (const row of rows) {
    const group = row.info.group ?? '';
    if (!groups.has(group)) groups.set(group, []);
    groups.get(group)!.push(row);
  }
  const sections = [...groups].map(([group, members]) => h('details', {class: 'control-group', attributes: {open: true}},
    h('summary', {}, group || 'Controls', h('small', {}, ` ${members.length}`)), ...members.map((row) => row.element)));
  const search = h('input', {
    attributes: {type: 'search', placeholder: 'Search controls', 'aria-label': 'Search controls'},
    on: {input: () => {
      const words = search.value.toLowerCase();
      for (const row of rows) row.element.hidden = !`${row.info.name} ${row.info.label ?? ''}`.toLowerCase().includes(words);
      for (const section of sections) section.hidden = !section.querySelector('.control:not([hidden])');
    }},
  });
  const panel = h('div', {class: controls.some((control) => control.moves) ? 'controls' : 'controls still'}, controls.length > 8 ? search : null);
  if (session) {
    panel.prepend(makePoseRow(context));
    const refresh = (): void => {
      for (const {info, show} of rows) {
        const moved = info.name in session.moved;
        show(moved ? session.moved[info.name] : session.values.value[info.name] ?? info.value ?? 0, moved);
      }
    };
    // the handle that is held and the sliders that are its own show each other
    const handles = model.meta.handles ?? [];
    for (const {info, element} of rows) {
      const own = handles.findIndex((handle) => handle.controls.includes(info.name));
      if (own >= 0) element.addEventListener('focusin', () => store.set({handle: own}));
    }
    scope.add(store.on(['handle'], ({handle}) => {
      const names = handles[handle]?.controls ?? [];
      const own = rows.filter(({info, element}) => element.classList.toggle('held', names.includes(info.name)));
      // where the panel is a part of the page (narrow screens), that would take the picture from under the pointer
      const scrolls = getComputedStyle(panel).overflowY !== 'visible';
      if (scrolls && own.length && !own.some(({element}) => element.contains(document.activeElement))) own[0].element.scrollIntoView({block: 'nearest'});
    }));
    scope.add(session.values.on(refresh));
    scope.add(session.touched.on(refresh));
  } else {
    panel.append(h('p', {class: 'note'}, 'A report does not evaluate; choose a control to see what it moves.'));
  }
  panel.append(...sections);
  return panel;
}

const title = (info: ControlInfo): string =>
  [info.name, info.min !== null && info.min !== undefined && info.max !== null && info.max !== undefined && `${number(info.min)} to ${number(info.max)} ${info.unit ?? ''}`]
    .filter(Boolean).join(', ');

function movesButton({store, scope}: Context, info: ControlInfo): HTMLElement | null {
  if (!info.moves) return null;
  const made = button('Moves', () => {
    const {paint} = store.now, same = paint?.kind === 'moves' && paint.name === info.name;
    store.set(same ? {paint: null} : {paint: {kind: 'moves', name: info.name}, mode: store.now.mode === 'difference' ? 'full' : store.now.mode});
  }, {title: `Colour what ${info.name} moves`, class: 'quiet', pressed: false});
  scope.add(store.on(['paint'], ({paint}) => setPressed(made, paint?.kind === 'moves' && paint.name === info.name)));
  return made;
}

function plainRow(context: Context, info: ControlInfo): Row {
  const range = info.min !== null && info.min !== undefined && info.max !== null && info.max !== undefined
    ? `${number(info.min)} to ${number(info.max)} ${info.unit ?? ''}` : '';
  const element = h('div', {class: 'control plain'}, h('span', {class: 'name', attributes: {title: title(info)}}, info.label ?? info.name),
    h('span', {class: 'range'}, range), movesButton(context, info));
  return {info, element, show: () => undefined};
}

function sliderRow(context: Context, info: ControlInfo): Row {
  const session = context.session!, min = info.min!, max = info.max!, start = info.value ?? 0;
  const whole = info.kind === 'integer' || info.kind === 'switch';
  const set = (value: number, event?: Event): void => {
    if (!Number.isFinite(value)) return;
    session.set({[info.name]: whole ? Math.round(value) : value}, event?.timeStamp);
  };
  const reset = (event: Event): void => session.release([info.name], event.timeStamp);
  const slider = h('input', {
    attributes: {type: 'range', min, max, step: whole ? 1 : 'any', 'aria-label': info.name, title: `${title(info)}; double click or Delete for the default`},
    on: {input: (event) => set(Number(slider.value), event), dblclick: reset},
  });
  // step "any" makes arrow keys useless in some browsers: a hundredth of the range instead
  slider.addEventListener('keydown', (event) => {
    if (event.key === 'Delete' || event.key === 'Backspace') {
      event.preventDefault();
      return reset(event);
    }
    const by = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1}[event.key];
    if (by === undefined || whole) return;
    event.preventDefault();
    event.stopPropagation();
    set(Math.min(max, Math.max(min, Number(slider.value) + by * (max - min) / (event.shiftKey ? 10 : 100))), event);
  });
  const field = h('input', {
    class: 'value', attributes: {type: 'number', step: whole ? 1 : 'any', 'aria-label': `${info.name}, value`},
    on: {change: (event) => set(Number(field.value), event)},
  });
  const element = h('div', {class: 'control'},
    h('label', {class: 'name', attributes: {title: title(info)}, on: {dblclick: reset}}, info.label ?? info.name),
    slider, field, h('span', {class: 'unit'}, info.unit ?? ''), movesButton(context, info));
  return {info, element, show: (value, moved) => {
    // most rows are as they were: what is not touched is not laid out or painted again
    const text = String(Number(value.toFixed(4)));
    if (Number(slider.value) !== value) slider.value = String(value);
    if (field.value !== text && document.activeElement !== field) field.value = text;
    element.classList.toggle('moved', moved && value !== start);
  }};
}
