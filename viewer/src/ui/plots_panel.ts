// Errors, times and what other tolerances would give.
import type {Context} from '../context';
import type {Series} from '../facts';
import {Chart, type Line} from './chart';
import {h, onceAFrame} from './dom';
import {duration, number, percent} from './format';
import {frameHistogram, residualHistogram} from './histogram';

export function makePlots(context: Context): HTMLElement | null {
  const {model, series, store, scope, facts} = context;
  const tolerances = model.meta.tolerances ?? [];
  const anything = series.some((s) => s.has('max_error') || s.has('full_us')) || (model.live && series.length > 0);
  if (!anything && !tolerances.length) return null;
  const ofClip = h('div', {class: 'charts'});
  const panel = h('div', {class: 'charts'}, ofClip);
  let charts: Chart[] = [];
  const close = (): void => {
    for (const chart of charts.splice(0)) chart.end();
  };

  scope.add(store.on(['clip'], ({clip}) => {
    close();
    charts = clip >= 0 ? clipCharts(context, series[clip]) : [];
    ofClip.replaceChildren(...charts.map((chart) => chart.element));
    if (clip < 0) ofClip.replaceChildren(h('p', {class: 'note'}, 'Choose a clip to see its errors and times.'));
    else void addHistogram(context, clip, ofClip, charts);
  }));
  const mark = onceAFrame(() => { for (const chart of charts) chart.refresh(false); });
  scope.add(store.on(['frame'], mark));
  if (model.live) {
    let waiting = false;
    scope.add(facts.on(() => {
      if (waiting) return;
      waiting = true;
      setTimeout(() => {
        waiting = false;
        for (const chart of charts) chart.refresh(true);
      }, 250);
    }));
  }
  scope.add(close);
  if (tolerances.length) {
    const ofTolerances = [toleranceChart(context, 'hits'), ...tolerances.some((t) => typeof t.speedup === 'number') ? [toleranceChart(context, 'speedup')] : []];
    for (const chart of ofTolerances) {
      scope.add(() => chart.end());
      panel.append(chart.element);
    }
  }
  return panel;
}

function clipCharts({model, store}: Context, series: Series): Chart[] {
  const frames = series.verdicts.length, x = Array.from({length: frames}, (_, i) => i), unit = model.unit;
  const common = {x, xLabel: 'frame', at: () => store.now.frame, pick: (frame: number) => store.set({playing: false, frame})};
  const charts: Chart[] = [];
  if (model.accelerated && (model.live || series.has('max_error'))) {
    const lines: Line[] = [{label: 'max', colour: '--plot-a', values: series.max_error}];
    if (model.live || series.has('rms_error')) lines.push({label: 'rms', colour: '--plot-b', values: series.rms_error});
    if (model.tolerance !== null) lines.push({label: 'tolerance', colour: '--bad', values: x.map(() => model.tolerance), dash: [6, 4]});
    charts.push(new Chart({...common, title: `Error (${unit.name})`, lines, yText: (y) => number(y / unit.metres)}));
  }
  if (model.live || series.has('full_us')) {
    const lines: Line[] = [{label: 'full', colour: '--plot-c', values: series.full_us}];
    if (model.accelerated) lines.push({label: 'accelerated', colour: '--plot-b', values: series.accelerated_us});
    charts.push(new Chart({...common, title: 'Time a frame', lines, yText: duration}));
  }
  return charts;
}

async function addHistogram({model, series, store, tell}: Context, clip: number, into: HTMLElement, charts: Chart[]): Promise<void> {
  if (model.live || !model.accelerated) return;
  const info = model.meta.clips![clip], {residual} = info;
  try {
    const values = residual ? await model.blob(residual.blob) as Int8Array | Int16Array : null;
    if (store.now.clip !== clip || (!values && !series[clip].has('max_error'))) return;
    const {x, share} = residual && values ? residualHistogram(info, model.points, values, residual.step) : frameHistogram(series[clip].max_error);
    const chart = new Chart({
      title: `Share of ${residual ? 'points, all frames' : 'frames'}, by error (${model.unit.name}); logarithmic`, x, xLabel: `error (${model.unit.name})`,
      xText: (e) => number(e / model.unit.metres), yText: percent, logY: true,
      lines: [{label: 'share', colour: '--plot-b', values: share.map((s) => s || null), bars: true}],
      at: () => model.tolerance !== null && model.tolerance <= x[x.length - 1] ? model.tolerance : null,
    });
    charts.push(chart);
    into.append(chart.element);
  } catch (error) {
    tell((error as Error).message);
  }
}

function toleranceChart({model}: Context, what: 'hits' | 'speedup'): Chart {
  const tolerances = model.meta.tolerances!;
  return new Chart({
    title: what === 'hits' ? 'Tolerance against frames that hit' : 'Tolerance against times as fast', x: tolerances.map((t) => t.tolerance),
    xLabel: `tolerance (${model.unit.name})`, logX: true, xMarks: tolerances.length <= 12 ? tolerances.map((t) => t.tolerance) : undefined,
    xText: (t) => number(t / model.unit.metres), yText: what === 'hits' ? percent : number,
    lines: [what === 'hits' ? {label: 'hits', colour: '--plot-a', values: tolerances.map((t) => t.hit_rate), points: true}
      : {label: 'times as fast', colour: '--plot-c', values: tolerances.map((t) => t.speedup ?? null), points: true}],
    at: () => model.tolerance,
  });
}
