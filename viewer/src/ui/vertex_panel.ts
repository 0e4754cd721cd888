// The selected vertex: where it is, what moves it, how far off it is over time; and the list of picked vertices.
import type {Context} from '../context';
import {Chart} from './chart';
import {button, h, onceAFrame, setPressed} from './dom';
import {length, number} from './format';
import {errorsOfPoint} from './histogram';

export function makeVertex(context: Context): HTMLElement {
  const {store, model, view, scope, session, tell} = context;
  const place = h('p', {class: 'details'});
  const index = h('input', {
    attributes: {type: 'number', min: 0, max: model.points - 1, step: 1, placeholder: 'index', 'aria-label': 'Vertex'},
    on: {change: () => {
      const vertex = Number(index.value);
      if (index.value !== '' && Number.isInteger(vertex) && vertex >= 0 && vertex < model.points) {
        const {picking, picked} = store.now;
        store.set({vertex, ...picking && !picked.includes(vertex) ? {picked: [...picked, vertex]} : {}});
      }
    }},
  });
  const movers = h('div', {class: 'movers'});
  const plot = h('div', {class: 'charts'});
  let chart: Chart | null = null;
  let lists = 0, plots = 0;  // an answer to an older question is dropped

  const list = (vertex: number): void => {
    const mine = ++lists;
    if (vertex >= 0) listMovers(context, vertex, movers, () => mine === lists).catch((error: Error) => { if (mine === lists) tell(error.message); });
  };

  const where = onceAFrame(() => {
    const {vertex} = store.now;
    if (document.activeElement !== index) index.value = vertex < 0 ? '' : String(vertex);
    if (vertex < 0) {
      place.textContent = 'Click the surface, or type an index, to choose a vertex.';
      return;
    }
    const mesh = model.meshes.find((m) => vertex >= m.first && vertex < m.first + m.count);
    const metres = [...view.shownPoints().subarray(3 * vertex, 3 * vertex + 3)].map((x) => x.toFixed(4));
    const inMesh = !mesh ? '' : mesh.first ? `, ${vertex - mesh.first} of ${mesh.name}` : ` of ${mesh.name}`;
    place.textContent = `Vertex ${vertex}${inMesh}, at ${metres.join(', ')} m`;
  });

  scope.add(store.on(['vertex', 'frame', 'clip', 'mode'], where));
  scope.add(context.facts.on(where));
  scope.add(store.on(['vertex'], ({vertex}) => {
    movers.replaceChildren();
    list(vertex);
  }));
  if (session) {
    // what moves a vertex is told of the pose that was evaluated last
    let timer = 0;
    scope.add(context.facts.on(() => {
      clearTimeout(timer);
      timer = window.setTimeout(() => list(store.now.vertex), 300);
    }));
    scope.add(() => clearTimeout(timer));
  }
  scope.add(store.on(['vertex', 'clip'], ({vertex, clip}) => {
    chart?.end();
    chart = null;
    plot.replaceChildren();
    ++plots;
    if (vertex >= 0 && clip >= 0) showErrors(vertex, clip).catch((error: Error) => tell(error.message));
  }));
  scope.add(store.on(['frame'], () => chart?.refresh(false)));
  scope.add(() => chart?.end());

  async function showErrors(vertex: number, clip: number): Promise<void> {
    const residual = model.meta.clips![clip].residual;
    if (!residual) return;
    const mine = plots, values = await model.blob(residual.blob) as Int8Array | Int16Array;
    if (mine !== plots) return;
    const errors = errorsOfPoint(model, clip, vertex, values), x = errors.map((_, i) => i);
    chart = new Chart({
      title: `Error of vertex ${vertex} (${model.unit.name})`, x, xLabel: 'frame', yText: (y) => number(y / model.unit.metres),
      lines: [
        {label: 'error', colour: '--plot-a', values: errors},
        ...model.tolerance === null ? [] : [{label: 'tolerance', colour: '--bad', values: x.map(() => model.tolerance), dash: [6, 4]}],
      ],
      at: () => store.now.frame, pick: (frame) => store.set({playing: false, frame}),
    });
    plot.replaceChildren(chart.element);
  }

  return h('div', {class: 'vertex'}, h('label', {class: 'row'}, 'Vertex', index), place, movers, plot, pickedList(context));
}

async function listMovers({model, session, store}: Context, vertex: number, into: HTMLElement, wanted: () => boolean): Promise<void> {
  const controls = (model.meta.controls ?? []).filter((control) => control.moves && control.moves_max);
  let found: {name: string; metres: number}[] = [];
  let lines: string[] = [];
  for (const control of controls) {
    const metres = (await model.blob(control.moves!))[vertex] / 255 * control.moves_max!;
    if (metres > 0) found.push({name: control.name, metres});
  }
  if (session) {
    const told = await session.client.explain(vertex);
    lines = told.lines;
    if (told.moved_by) found = told.moved_by;
  }
  if (!wanted()) return;
  found.sort((a, b) => b.metres - a.metres);
  const most = found[0]?.metres ?? 1;
  const name = (plug: string): string => model.meta.controls?.find((c) => c.name === plug)?.label ?? plug;
  const parts: HTMLElement[] = [];
  if (controls.length || session) parts.push(h('h3', {}, found.length ? 'Moved by' : 'No control moves it'));
  parts.push(h('ul', {class: 'bars'}, ...found.slice(0, 30).map(({name: plug, metres}) => h('li', {},
    h('button', {attributes: {type: 'button', title: `Show what ${plug} moves`, disabled: !controls.some((c) => c.name === plug)},
      on: {click: () => store.set({paint: {kind: 'moves', name: plug}, mode: 'full'})}}, h('span', {class: 'bar', attributes: {style: `width:${(metres / most * 100).toFixed(1)}%`}}), h('span', {class: 'name'}, name(plug)),
      h('span', {class: 'value'}, length(metres, model)))))));
  if (lines.length) parts.push(h('pre', {class: 'lines'}, lines.join('\n')));
  // the same again would take the focus from its buttons
  if (parts.map((part) => part.outerHTML).join('') !== into.innerHTML) into.replaceChildren(...parts);
}

/** Clicks collect vertices; shown as the YAML list that rigs are written with. */
function pickedList({store, scope, tell}: Context): HTMLElement {
  const pick = button('Pick vertices', () => store.set({picking: !store.now.picking}), {title: 'Clicks collect vertices (P)', pressed: false});
  const text = h('textarea', {class: 'yaml', attributes: {readonly: true, rows: 3, 'aria-label': 'Picked vertices as YAML'}});
  const copy = button('Copy', () => {
    text.select();
    // clipboard needs a secure page; a page from disk may have to use the old way
    const done = (): void => tell('copied');
    if (navigator.clipboard) navigator.clipboard.writeText(text.value).then(done, () => { if (document.execCommand('copy')) done(); });
    else if (document.execCommand('copy')) done();
  });
  const clear = button('Clear', () => store.set({picked: []}));
  const row = h('div', {class: 'row'}, copy, clear);
  scope.add(store.on(['picking', 'picked'], ({picking, picked}) => {
    setPressed(pick, picking);
    text.value = `vertices: [${picked.join(', ')}]`;
    text.hidden = row.hidden = !picking && !picked.length;
  }));
  return h('div', {class: 'picked'}, pick, text, row);
}
