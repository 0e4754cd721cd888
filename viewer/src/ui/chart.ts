// uPlot with the colours of the page, that follows the width of its panel and the theme.
import uPlot from 'uplot';
import {h, onceAFrame, themeColour} from './dom';
import {number} from './format';

export interface Line {
  label: string;
  colour: string;  // a name of the style sheet
  values: (number | null)[];
  dash?: number[];
  points?: boolean;
  bars?: boolean;
}

export interface ChartOptions {
  title: string;
  x: number[];
  xLabel: string;
  xText?: (x: number) => string;
  yText?: (y: number) => string;
  lines: Line[];
  logX?: boolean;
  logY?: boolean;
  height?: number;
  /** Marks x with a vertical line. */
  at?: () => number | null;
  /** Where the x axis has its marks; without, where uPlot puts them. */
  xMarks?: number[];
  pick?: (x: number) => void;
}

export class Chart {
  readonly element: HTMLElement;
  private readonly place: HTMLElement;
  private plot: uPlot | null = null;
  private readonly line = h('div', {class: 'chart-line', attributes: {hidden: true}});
  private readonly watch: ResizeObserver;
  private shown = false;
  private old = false;    // its values are
  private stale = false;  // its colours are of another theme
  private readonly rebuild = (): void => {
    this.stale = true;
    this.build();
  };

  constructor(private readonly options: ChartOptions) {
    this.place = h('div', {class: 'chart-place'});
    this.element = h('figure', {class: 'chart', attributes: {'aria-label': options.title}}, h('figcaption', {}, options.title), this.place);
    this.watch = new ResizeObserver(onceAFrame(() => this.resize()));
    this.watch.observe(this.place);
    document.addEventListener('kpsa-theme', this.rebuild);
  }

  private resize(): void {
    const width = this.place.clientWidth;
    this.shown = width > 0;
    if (!width) return;
    if (!this.plot || this.stale) this.build();
    else if (this.plot.width !== width) this.plot.setSize({width, height: this.options.height ?? 170});
    else this.refresh(this.old);
  }

  private build(): void {
    const width = this.place.clientWidth, {options} = this;
    if (!width) return;
    this.stale = false;
    this.plot?.destroy();
    const ink = themeColour('--muted'), grid = {stroke: themeColour('--grid'), width: 1};
    const font = '11px system-ui, sans-serif';
    const xText = options.xText ?? number, yText = options.yText ?? number;
    const yWidth = (_: uPlot, values: string[] | null): number => 16 + 6.5 * Math.max(2, ...(values ?? []).map((v) => v?.length ?? 0));
    // bars stand about their x: the first and the last need room
    const bars = options.lines.some((line) => line.bars), room = bars && options.x.length > 1 ? (options.x[1] - options.x[0]) / 2 : 0;
    this.plot = new uPlot({
      width, height: options.height ?? 170,
      padding: [8, 10, 0, 0],
      cursor: {y: false, points: {size: 6}},
      legend: {live: true},
      scales: {
        x: {time: false, distr: options.logX ? 3 : 1, ...bars ? {range: (_: uPlot, low: number, high: number): [number, number] => [low - room, high + room]} : {}},
        y: options.logY ? {distr: 3, log: 10} : {range: (_, low, high) => [Math.min(0, low ?? 0), Math.max(1e-12, (high ?? 1) * 1.08)]},
      },
      axes: [
        {stroke: ink, grid, ticks: grid, font, size: 34, label: options.xLabel, labelSize: 16, labelFont: font, labelGap: 0, values: (_, ticks) => ticks.map((t) => t === null ? '' : xText(t)), ...options.xMarks ? {splits: options.xMarks, filter: (_: uPlot, marks: number[]) => marks} : {}},
        {stroke: ink, grid, ticks: grid, font, size: yWidth, ...options.logY ? {splits: (_: uPlot, __: number, low: number, high: number) => decades(low, high), filter: (_: uPlot, marks: number[]) => marks} : {}, values: (_, ticks) => ticks.map((t) => t === null ? '' : yText(t))},
      ],
      series: [
        {label: options.xLabel, value: (_, x) => x === null ? '-' : xText(x)},
        ...options.lines.map((line): uPlot.Series => ({
          label: line.label, stroke: themeColour(line.colour), width: line.dash ? 1.25 : 1.5, dash: line.dash, spanGaps: false,
          points: {show: line.points ?? false, size: 5},
          value: (_, y) => y === null || y === undefined ? '-' : yText(y),
          ...line.bars ? {paths: uPlot.paths.bars!({size: [0.9, 60]}), fill: themeColour(line.colour) + '99', points: {show: false}} : {},
        })),
      ],
      hooks: {
        ready: [(plot) => this.listen(plot)],
        setSize: [(plot) => this.mark(plot)], setScale: [(plot) => this.mark(plot)],
        setSeries: [(plot, index) => {
          const name = index === null ? null : plot.root.querySelectorAll('.u-legend .u-series > th')[index];
          name?.setAttribute('aria-pressed', String(plot.series[index!].show !== false));
        }],
      },
    }, this.data(), this.place);
    this.plot.over.append(this.line);
    this.mark(this.plot);
  }

  private data(): uPlot.AlignedData {
    return [this.options.x, ...this.options.lines.map((line) => line.values)] as uPlot.AlignedData;
  }

  /** The line at x, which goes over the plot: the plot is not drawn again for it. */
  private mark(plot: uPlot): void {
    const x = this.options.at?.() ?? null, left = x === null ? NaN : plot.valToPos(x, 'x');
    const inside = left >= 0 && left <= plot.bbox.width / uPlot.pxRatio;
    this.line.hidden = !inside;
    if (x === null || !inside) return;
    this.line.style.transform = `translateX(${Math.round(left) - 1}px)`;
    // while the pointer is away, the legend has the values of the line
    if (plot.cursor.left === undefined || plot.cursor.left < 0) {
      const index = this.indexOf(x);
      if (index >= 0) plot.setLegend({idx: index}, false);
    }
  }

  private indexOf(x: number): number {
    const {x: all} = this.options;
    return all[x] === x ? x : all.indexOf(x);  // frames are their own places
  }

  private listen(plot: uPlot): void {
    this.reachLegend(plot);
    const {pick} = this.options;
    if (!pick) return;
    plot.over.style.cursor = 'pointer';
    plot.over.addEventListener('click', (event) => {
      const index = plot.posToIdx(event.offsetX);
      pick(this.options.x[index]);
    });
  }

  /** Lines are shown and hidden by a click on their names; by keys as well. */
  private reachLegend(plot: uPlot): void {
    const names = [...plot.root.querySelectorAll<HTMLElement>('.u-legend .u-series > th')];
    names.forEach((name, series) => {
      if (!series) return;  // the axis
      name.tabIndex = 0;
      name.setAttribute('role', 'button');
      name.setAttribute('aria-label', `${this.options.lines[series - 1].label}, shown`);
      name.setAttribute('aria-pressed', String(plot.series[series].show !== false));
      name.addEventListener('keydown', (event) => {
        if (event.key !== 'Enter' && event.key !== ' ') return;
        event.preventDefault();
        event.stopPropagation();
        name.click();
      });
    });
  }

  /** Draws again; `fresh`: the values have changed. What is not seen waits until it is. */
  refresh(fresh: boolean): void {
    if (fresh && !this.shown) this.old = true;
    if (!this.plot || !this.shown) return;
    if (fresh) {
      this.old = false;
      this.plot.setData(this.data());
    }
    this.mark(this.plot);
  }

  end(): void {
    this.watch.disconnect();
    document.removeEventListener('kpsa-theme', this.rebuild);
    this.plot?.destroy();
  }
}

function decades(low: number, high: number): number[] {
  const marks: number[] = [];
  for (let e = Math.ceil(Math.log10(Math.max(1e-12, low)) - 1e-9); 10 ** e <= high * 1.0001; ++e) marks.push(10 ** e);
  return marks;
}
