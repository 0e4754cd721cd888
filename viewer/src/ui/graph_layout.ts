// Places of the nodes of a graph: columns by the longest way from a source, in each column near what they read.
import type {NodeInfo} from '../data/meta';

export interface Layout {
  x: number[];
  y: number[];
  width: number;
  height: number;
}

export const box = {width: 150, height: 22, across: 40, down: 6};

export function layOut(nodes: readonly NodeInfo[]): Layout {
  const count = nodes.length, inputs = nodes.map((node) => node.inputs.filter((i) => i >= 0 && i < count));
  const layer = layersOf(inputs);
  const columns: number[][] = [];
  layer.forEach((l, i) => (columns[l] ??= []).push(i));
  const outputs: number[][] = nodes.map(() => []);
  inputs.forEach((from, to) => { for (const i of from) outputs[i].push(to); });

  const rank = new Array<number>(count).fill(0);
  const number = (column: number[]): void => column.forEach((node, i) => { rank[node] = i / Math.max(1, column.length - 1); });
  columns.forEach(number);
  const sortBy = (neighbours: number[][]) => (column: number[]): void => {
    const mean = (node: number): number => neighbours[node].length ? neighbours[node].reduce((sum, i) => sum + rank[i], 0) / neighbours[node].length : rank[node];
    const wanted = new Map(column.map((node) => [node, mean(node)]));
    column.sort((a, b) => wanted.get(a)! - wanted.get(b)! || a - b);
    number(column);
  };
  for (let sweep = 0; sweep < 4; ++sweep) {
    columns.slice(1).forEach(sortBy(inputs));
    [...columns].reverse().slice(1).forEach(sortBy(outputs));
  }

  // A layer of hundreds becomes several columns next to each other.
  const most = Math.max(12, Math.ceil(Math.sqrt(count) * 1.6));
  const x = new Array<number>(count).fill(0), y = new Array<number>(count).fill(0);
  // Columns go on in a line below when the drawing would be much wider than high.
  const area = columns.reduce((sum, column) => sum + (box.width + box.across) * (column.length + 2) * (box.height + box.down), 0);
  const widest = Math.max(4 * (box.width + box.across), Math.sqrt(area * 1.4));
  let left = 0, height = 0, top = 0, width = 1, line: number[] = [];
  const endLine = (): void => {
    for (const node of line) y[node] += top + height / 2 - box.height / 2;
    top += height + 2 * box.height;
    line = [];
    left = height = 0;
  };
  for (const column of columns) {
    if (left > widest) endLine();
    const parts = Math.max(1, Math.ceil(column.length / most)), each = Math.ceil(column.length / parts);
    for (let part = 0; part < parts; ++part) {
      const members = column.slice(part * each, (part + 1) * each), offset = -(members.length - 1) / 2;
      members.forEach((node, i) => {
        x[node] = left;
        y[node] = (offset + i) * (box.height + box.down);
        line.push(node);
      });
      height = Math.max(height, members.length * (box.height + box.down));
      width = Math.max(width, left + box.width);
      left += box.width + (part + 1 < parts ? box.down : box.across);
    }
  }
  endLine();
  return {x, y, width, height: Math.max(1, top - 2 * box.height)};
}

/** The longest way to each node; a node in a cycle is placed as if the edge that closes it were absent. */
function layersOf(inputs: readonly number[][]): number[] {
  const layer = new Array<number>(inputs.length).fill(-1), open = new Array<boolean>(inputs.length).fill(false);
  for (let start = 0; start < inputs.length; ++start) {
    const stack = [start];
    while (stack.length) {
      const node = stack[stack.length - 1];
      if (layer[node] >= 0) {
        stack.pop();
        continue;
      }
      const missing = open[node] ? [] : inputs[node].filter((i) => layer[i] < 0 && !open[i]);
      open[node] = true;
      if (missing.length) for (const i of missing) stack.push(i);
      else {
        layer[node] = inputs[node].reduce((most, i) => Math.max(most, layer[i]), -1) + 1;
        stack.pop();
      }
    }
  }
  return layer;
}
