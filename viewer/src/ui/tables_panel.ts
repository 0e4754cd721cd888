// The tables of bench, profile, training and promise.
import type {Context} from '../context';
import {DataTable} from './data_table';
import {h} from './dom';

export function makeTables({model}: Context): HTMLElement | null {
  const tables = model.meta.tables ?? [];
  if (!tables.length) return null;
  return h('div', {class: 'tables'}, ...tables.map((table) => h('section', {},
    h('h3', {}, table.title),
    table.note ? h('p', {class: 'note'}, table.note) : null,
    new DataTable({label: table.title, columns: table.columns, rows: table.rows}).element)));
}
