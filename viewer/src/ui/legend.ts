// The scale of the colours in the picture: errors with the tolerance as a line, or a field.
import type {Context} from '../context';
import {errorColour, fieldColour, gradient} from '../view/colours';
import {h} from './dom';
import {length, number} from './format';

export function makeLegend(context: Context): HTMLElement {
  const {store, model, scope, view} = context;
  const title = h('div', {class: 'legend-title'});
  const bar = h('div', {class: 'legend-bar'});
  const line = h('div', {class: 'legend-line'});
  const low = h('span'), middle = h('span', {class: 'legend-middle'}), high = h('span');
  const scale = h('div', {class: 'legend-scale'}, low, middle, high);
  const factor = h('select', {
    attributes: {'aria-label': 'What the colours span', title: 'What the colours span'}, on: {change: () => store.set({errorTop: Number(factor.value)})},
  });
  const base = model.tolerance ?? model.unit.metres;
  for (const times of [0.25, 0.5, 1, 2, 4]) factor.append(h('option', {attributes: {value: base * times}}, `0 to ${length(base * times, model)}`));
  const legend = h('div', {class: 'legend'}, h('div', {class: 'legend-head'}, title, factor), h('div', {class: 'legend-track'}, bar, line), scale);

  scope.add(store.on(['errorTop'], ({errorTop}) => view.setErrorTop(errorTop, errorTop / base)));
  scope.add(store.on(['mode', 'paint', 'errorTop'], ({mode, paint, errorTop}) => {
    const errors = mode === 'difference';
    legend.hidden = !errors && !paint;
    factor.hidden = line.hidden = !errors;
    factor.value = String(errorTop);
    if (errors) {
      const tolerance = model.tolerance;
      title.textContent = 'Difference of both';
      bar.style.background = gradient(errorColour, errorTop / base);
      low.textContent = '0';
      high.textContent = length(errorTop, model);
      const at = tolerance === null ? 2 : tolerance / errorTop;
      line.hidden = at > 1;
      line.style.left = `${Math.min(1, at) * 100}%`;
      middle.textContent = tolerance === null ? '' : `tolerance ${length(tolerance, model)}`;
    } else if (paint) {
      const control = paint.kind === 'moves' ? model.meta.controls?.find((c) => c.name === paint.name) : undefined;
      const field = paint.kind === 'field' ? model.meta.fields?.find((f) => f.name === paint.name) : undefined;
      title.textContent = control ? `Moved by ${control.label ?? control.name}` : field?.label ?? paint.name;
      bar.style.background = gradient(fieldColour, 1);
      low.textContent = '0';
      middle.textContent = '';
      high.textContent = control ? length(control.moves_max ?? null, model) : number(1);
    }
  }));
  return legend;
}
