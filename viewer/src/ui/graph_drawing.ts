// The graph as a drawing that is moved by dragging and zoomed by the wheel.
import type {NodeInfo} from '../data/meta';
import {onceAFrame, svg} from './dom';
import {box, layOut} from './graph_layout';

export class GraphDrawing {
  readonly element: SVGSVGElement;
  private readonly groups: SVGGElement[];
  private readonly wires = new Map<number, SVGPathElement[]>();
  private readonly layout;
  private view = {x: 0, y: 0, scale: 1};
  private fitted = false;
  private dragged = false;  // since the button went down

  constructor(nodes: readonly NodeInfo[], choose: (node: number) => void, hover: (node: number) => void) {
    const layout = this.layout = layOut(nodes);
    const paths: SVGPathElement[] = [];
    nodes.forEach((node, to) => {
      for (const from of node.inputs) {
        if (!nodes[from]) continue;
        const x0 = layout.x[from] + box.width, y0 = layout.y[from] + box.height / 2, x1 = layout.x[to], y1 = layout.y[to] + box.height / 2;
        const bend = Math.max(16, Math.abs(x1 - x0) / 2);
        const path = svg('path', {d: `M${x0} ${y0}C${x0 + bend} ${y0} ${x1 - bend} ${y1} ${x1} ${y1}`});
        paths.push(path);
        for (const end of [from, to]) this.wiresOf(end).push(path);
      }
    });
    this.groups = nodes.map((node, i) => {
      const group = svg('g', {transform: `translate(${layout.x[i]} ${layout.y[i]})`, class: 'node'},
        svg('rect', {width: box.width, height: box.height, rx: 3}),
        svg('text', {x: 7, y: 15}, node.name.length > 22 ? node.name.slice(0, 21) + '…' : node.name));
      group.addEventListener('pointerenter', () => hover(i));
      group.addEventListener('pointerleave', () => hover(-1));
      group.addEventListener('click', () => { if (!this.dragged) choose(i); });
      return group;
    });
    this.element = svg('svg', {class: 'graph', role: 'img', 'aria-label': 'The graph of nodes; the list below has the same nodes'},
      svg('g', {class: 'wires'}, ...paths), ...this.groups);
    this.listen();
  }

  private wiresOf(node: number): SVGPathElement[] {
    let found = this.wires.get(node);
    if (!found) this.wires.set(node, found = []);
    return found;
  }

  /** A colour and whether it is faint, for each node. */
  paint(colour: (node: number) => string, faint: (node: number) => boolean): void {
    this.groups.forEach((group, i) => {
      (group.firstElementChild as SVGRectElement).style.fill = colour(i);
      group.classList.toggle('faint', faint(i));
    });
  }

  select(node: number, bring: boolean): void {
    this.groups.forEach((group, i) => group.classList.toggle('chosen', i === node));
    for (const paths of this.wires.values()) for (const path of paths) path.classList.remove('chosen');
    for (const path of this.wires.get(node) ?? []) path.classList.add('chosen');
    if (node < 0 || !bring) return;
    const {clientWidth: width, clientHeight: height} = this.element, {scale} = this.view;
    const readable = Math.max(scale, 0.7);
    this.view = {scale: readable, x: this.layout.x[node] + box.width / 2 - width / 2 / readable, y: this.layout.y[node] + box.height / 2 - height / 2 / readable};
    this.apply();
  }

  /** All of it, once the drawing has a size. */
  fit(again: boolean): void {
    const {clientWidth: width, clientHeight: height} = this.element;
    if (!width || (this.fitted && !again)) return;
    this.fitted = true;
    const scale = Math.min(1, width / (this.layout.width + 24), height / (this.layout.height + 24));
    this.view = {scale, x: (this.layout.width - width / scale) / 2, y: (this.layout.height - height / scale) / 2};
    this.apply();
  }

  zoom(factor: number, x = this.element.clientWidth / 2, y = this.element.clientHeight / 2): void {
    const scale = Math.min(3, Math.max(0.05, this.view.scale * factor));
    this.view.x += x / this.view.scale - x / scale;
    this.view.y += y / this.view.scale - y / scale;
    this.view.scale = scale;
    this.apply();
  }

  private apply(): void {
    const {x, y, scale} = this.view, {clientWidth: width, clientHeight: height} = this.element;
    if (width && height) this.element.setAttribute('viewBox', `${x} ${y} ${width / scale} ${height / scale}`);
    this.element.classList.toggle('small', scale < 0.35);
  }

  private listen(): void {
    let last: {x: number; y: number} | null = null, down = {x: 0, y: 0};
    this.element.addEventListener('wheel', (event) => {
      event.preventDefault();
      const at = this.element.getBoundingClientRect();
      this.zoom(Math.exp(-event.deltaY / 400), event.clientX - at.left, event.clientY - at.top);
    }, {passive: false});
    this.element.addEventListener('pointerdown', (event) => {
      last = down = {x: event.clientX, y: event.clientY};
      this.dragged = false;
    });
    this.element.addEventListener('pointermove', (event) => {
      if (!last || !event.buttons) return;
      if (Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4) this.dragged = true;
      this.view.x -= (event.clientX - last.x) / this.view.scale;
      this.view.y -= (event.clientY - last.y) / this.view.scale;
      last = {x: event.clientX, y: event.clientY};
      this.apply();
    });
    new ResizeObserver(onceAFrame(() => {
      this.fit(false);
      this.apply();
    })).observe(this.element);
  }
}
