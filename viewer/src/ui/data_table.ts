// A table whose columns sort.
import type {Cell} from '../data/meta';
import {h} from './dom';
import {number} from './format';

export interface Column {
  name: string;
  unit?: string | null;
  note?: string | null;
}

export interface TableOptions {
  label: string;
  columns: readonly Column[];
  rows: readonly Cell[][];
  choose?: (row: number) => void;
  hover?: (row: number) => void;
}

export class DataTable {
  readonly element: HTMLElement;
  private readonly body = h('tbody');
  private readonly lines: HTMLTableRowElement[];
  private readonly heads: HTMLTableCellElement[];
  private sorted = -1;
  private down = false;

  constructor(private readonly options: TableOptions) {
    const {columns, rows} = options;
    const numeric = columns.map((_, c) => rows.some((row) => typeof row[c] === 'number'));
    this.heads = columns.map((column, c) => h('th', {class: numeric[c] ? 'number' : undefined, attributes: {scope: 'col', 'aria-sort': 'none'}},
      h('button', {attributes: {type: 'button', title: column.note ?? 'Sort'}, on: {click: () => this.sort(c, numeric[c])}},
        column.name, column.unit ? h('small', {}, ` ${column.unit}`) : null)));
    this.lines = rows.map((row, r) => h('tr', {
      attributes: options.choose ? {tabindex: 0} : {},
      on: {
        click: () => options.choose?.(r),
        keydown: (event) => { if (event.key === 'Enter') options.choose?.(r); },
        pointerenter: () => options.hover?.(r),
        pointerleave: () => options.hover?.(-1),
      },
    }, ...columns.map((_, c) => {
      const cell = row[c];
      return h('td', {class: numeric[c] ? 'number' : undefined, attributes: {title: typeof cell === 'string' && cell.length > 24 ? cell : null}}, typeof cell === 'number' ? number(cell) : cell ?? '');
    })));
    this.body.append(...this.lines);
    this.element = h('div', {class: 'table-place', attributes: {tabindex: 0, role: 'region', 'aria-label': options.label}},
      h('table', {class: options.choose ? 'choosable' : undefined}, h('thead', {}, h('tr', {}, ...this.heads)), this.body));
  }

  private sort(column: number, numeric: boolean): void {
    this.down = this.sorted === column ? !this.down : numeric;
    this.sorted = column;
    const {rows} = this.options, sign = this.down ? -1 : 1;
    const order = rows.map((_, i) => i).sort((a, b) => {
      const x = rows[a][column], y = rows[b][column];
      if (x === y) return a - b;
      if (x === null || x === undefined) return 1;
      if (y === null || y === undefined) return -1;
      return sign * (typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), 'en', {numeric: true}));
    });
    this.body.replaceChildren(...order.map((i) => this.lines[i]));
    this.heads.forEach((head, c) => head.setAttribute('aria-sort', c !== column ? 'none' : this.down ? 'descending' : 'ascending'));
  }

  /** Hides the rows that `keep` refuses; the number of those left. */
  filter(keep: (row: number) => boolean): number {
    let count = 0;
    this.lines.forEach((line, i) => {
      line.hidden = !keep(i);
      if (!line.hidden) ++count;
    });
    return count;
  }

  select(row: number, scroll: boolean): void {
    this.lines.forEach((line, i) => line.classList.toggle('chosen', i === row));
    if (scroll && row >= 0) this.lines[row].scrollIntoView({block: 'nearest'});
  }
}
