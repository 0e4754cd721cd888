// The nodes of the rig: which run, how long they take, and what they read.
import type {Context} from '../context';
import type {NodeInfo} from '../data/meta';
import {DataTable} from './data_table';
import {button, h, themeColour} from './dom';
import {duration} from './format';
import {GraphDrawing} from './graph_drawing';

type ColourBy = 'state' | 'full_us' | 'accelerated_us';

const stateColours: Record<string, string> = {'kept': '--state-kept', 'cues only': '--state-cues', 'never run': '--state-never', 'switched off': '--state-off'};

export function makeGraph({model, store, scope}: Context): HTMLElement | null {
  const nodes = model.meta.nodes ?? [];
  if (!nodes.length) return null;
  const has = (what: ColourBy): boolean => nodes.some((node) => node[what] !== null && node[what] !== undefined);
  const ways: [ColourBy, string][] = [['state', 'state'], ['full_us', 'time, full'], ['accelerated_us', 'time, accelerated']];
  const possible = ways.filter(([what]) => has(what));
  let colourBy: ColourBy = possible[0]?.[0] ?? 'state', words = '';

  const details = h('p', {class: 'details', attributes: {'aria-live': 'polite'}});
  const matches = (i: number): boolean => `${nodes[i].name} ${nodes[i].type}`.toLowerCase().includes(words);
  const drawing = new GraphDrawing(nodes, (i) => store.set({node: store.now.node === i ? -1 : i}), (i) => describe(i < 0 ? store.now.node : i));
  const columns = [{name: 'node'}, {name: 'type'}, ...has('state') ? [{name: 'state'}] : [], ...has('full_us') ? [{name: 'full', unit: 'µs'}] : [],
    ...has('accelerated_us') ? [{name: 'accel.', unit: 'µs'}] : [], {name: 'points'}];
  const table = new DataTable({
    label: 'Nodes', columns,
    rows: nodes.map((node) => [node.name, node.type, ...has('state') ? [node.state ?? null] : [], ...has('full_us') ? [node.full_us ?? null] : [],
      ...has('accelerated_us') ? [node.accelerated_us ?? null] : [], node.points ?? null]),
    choose: (row) => store.set({node: row}), hover: (row) => describe(row < 0 ? store.now.node : row),
  });

  function describe(i: number): void {
    if (i < 0) {
      details.textContent = `${nodes.length} nodes. Hover or choose one.`;
      return;
    }
    const node = nodes[i];
    details.textContent = [`${node.name} (${node.type})`, node.state, node.full_us !== null && node.full_us !== undefined && `full ${duration(node.full_us)}`,
      node.accelerated_us !== null && node.accelerated_us !== undefined && `accelerated ${duration(node.accelerated_us)}`,
      node.points && `${node.points} points`, node.reason].filter(Boolean).join(', ');
  }

  const longest = (by: ColourBy, least: number): number => nodes.reduce((most, node) => Math.max(most, by === 'state' ? 0 : node[by] ?? 0), least);
  const paint = (): void => {
    const most = colourBy === 'state' ? 1 : longest(colourBy, 1e-9);
    drawing.paint((i) => colourOf(nodes[i], colourBy, most), (i) => !matches(i));
    const left = table.filter(matches);
    found.textContent = words ? `${left} of ${nodes.length}` : '';
  };
  const found = h('span', {class: 'found', attributes: {'aria-live': 'polite'}});
  const search = h('input', {
    attributes: {type: 'search', placeholder: 'Search nodes', 'aria-label': 'Search nodes'},
    on: {
      input: () => {
        words = search.value.trim().toLowerCase();
        paint();
      },
      keydown: (event) => {
        const first = nodes.findIndex((_, i) => matches(i));
        if (event.key === 'Enter' && first >= 0) store.set({node: first});
      },
    },
  });
  const choice = h('select', {attributes: {'aria-label': 'Colours of nodes'}, on: {change: () => {
    colourBy = choice.value as ColourBy;
    paint();
    legend();
  }}}, ...possible.map(([what, label]) => h('option', {attributes: {value: what}}, label)));
  const key = h('div', {class: 'key'});
  const legend = (): void => {
    const states = [...new Set(nodes.map((node) => node.state).filter((s) => s !== null && s !== undefined))];
    key.replaceChildren(...colourBy === 'state' ? states.map((state) => h('span', {}, h('i', {attributes: {style: `background:var(${stateColours[state]})`}}), state))
      : [h('span', {}, h('i', {class: 'ramp'}), `0 to ${duration(longest(colourBy, 0))}`)]);
  };

  document.addEventListener('kpsa-theme', paint);
  scope.add(() => document.removeEventListener('kpsa-theme', paint));
  scope.add(store.on(['node'], ({node}) => {
    drawing.select(node, true);
    table.select(node, true);
    describe(node);
  }));
  paint();
  legend();
  return h('div', {class: 'graph-panel'},
    h('div', {class: 'row'}, search, found, possible.length > 1 ? choice : null, button('−', () => drawing.zoom(0.75), {title: 'Smaller'}), button('+', () => drawing.zoom(1.33), {title: 'Larger'}),
      button('Fit', () => drawing.fit(true), {title: 'All of the graph'})),
    key, h('div', {class: 'graph-place'}, drawing.element), details, table.element);
}

function colourOf(node: NodeInfo, by: ColourBy, most: number): string {
  if (by === 'state') return `var(${stateColours[node.state ?? ''] ?? '--state-off'})`;
  const share = Math.sqrt((node[by] ?? 0) / most);
  return `color-mix(in oklab, ${themeColour('--hot')} ${(share * 100).toFixed(0)}%, ${themeColour('--cold')})`;
}
