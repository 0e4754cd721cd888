// What is measured on every frame: a list, joined to the marks in the picture.
import type {Context} from '../context';
import type {Mark} from '../draw/marks';
import {DataTable} from './data_table';
import {h} from './dom';
import {duration} from './format';

/** Cues that have a place, and which mark each is. */
export function cueMarks({model}: Context): {marks: Mark[]; cueOf: number[]} {
  const marks: Mark[] = [], cueOf: number[] = [], {rest} = model;
  (model.meta.cues ?? []).forEach((cue, i) => {
    if (!cue.position) return;
    const vertex = cue.vertex ?? -1, at = cue.position;
    const offset = vertex < 0 ? at : [0, 1, 2].map((c) => at[c] - rest[3 * vertex + c]) as [number, number, number];
    marks.push({vertex, offset});
    cueOf.push(i);
  });
  return {marks, cueOf};
}

export function describeCue({model}: Context, index: number): string {
  const cue = model.meta.cues![index];
  return [cue.kind, cue.stage && `at ${cue.stage}`, cue.cost_us !== null && cue.cost_us !== undefined && `${duration(cue.cost_us)} of a frame`, cue.sees]
    .filter(Boolean).join(', ');
}

const plurals: Record<string, string> = {point: 'points', matrix: 'matrices', scalar: 'scalars', product: 'products'};

export function makeCues(context: Context): HTMLElement | null {
  const {model, store, scope} = context, cues = model.meta.cues ?? [];
  if (!cues.length) return null;
  const details = h('p', {class: 'details', attributes: {'aria-live': 'polite'}});
  const table = new DataTable({
    label: 'Cues',
    columns: [{name: 'cue'}, {name: 'kind'}, {name: 'stage'}, {name: 'cost', unit: 'µs', note: 'a frame: its part of the time that measuring all of them takes'}],
    rows: cues.map((cue) => [cue.name, cue.kind, cue.stage ?? null, cue.cost_us ?? null]),
    choose: (row) => store.set({cue: store.now.cue === row ? -1 : row, showCues: true}),
  });
  scope.add(store.on(['cue'], ({cue}) => {
    table.select(cue, true);
    details.textContent = cue < 0 ? 'Choose a cue, here or in the picture.' : `${cues[cue].name}: ${describeCue(context, cue)}`;
  }));
  const count = new Map<string, number>();
  for (const cue of cues) count.set(cue.kind, (count.get(cue.kind) ?? 0) + 1);
  const costs = cues.flatMap((cue) => cue.cost_us === null || cue.cost_us === undefined ? [] : [cue.cost_us]);
  const cost = costs.length ? ` That takes ${duration(costs.reduce((sum, us) => sum + us, 0))} of a frame. What cues share of it is split between them; the joints and drivers that move them run in any case.` : '';
  return h('div', {class: 'cues'},
    h('p', {class: 'note'}, `${cues.length === 1 ? 'One cue is' : `${cues.length} cues are`} measured in every frame: ${[...count].map(([kind, n]) => `${n} ${n === 1 ? kind : plurals[kind] ?? kind}`).join(', ')}.${cost}`),
    details, table.element);
}
