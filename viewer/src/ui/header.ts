// The head line: which rig, the few figures that matter, theme and help.
import type {Context} from '../context';
import {button, h} from './dom';
import {length} from './format';
import type {Help} from './help';
import {applyTheme, theme} from './theme';

export function makeHeader(into: HTMLElement, {model, scope}: Context, help: Help): void {
  const {meta} = model;
  document.title = meta.title ?? meta.rig ?? 'kpsa';
  const themeButton = button('', () => applyTheme(theme() === 'dark' ? 'light' : 'dark'), {title: 'Dark or light (T)'});
  const name = (): void => { themeButton.textContent = theme() === 'dark' ? 'Light' : 'Dark'; };
  name();
  document.addEventListener('kpsa-theme', name);
  scope.add(() => document.removeEventListener('kpsa-theme', name));
  const origin = [
    meta.rig, meta.character, `${model.points.toLocaleString('en-US')} points`, model.live ? 'live' : meta.made,
    meta.shape?.precision ? `stored to ${length(meta.shape.precision, model)}` : null, meta.program,
  ].filter(Boolean).join('  ·  ');
  into.replaceChildren(
    h('div', {class: 'name'}, h('h1', {}, meta.title ?? meta.rig ?? 'kpsa'), h('p', {attributes: {title: origin}}, origin)),
    meta.summary?.length ? h('dl', {class: 'summary'}, ...meta.summary.map(({label, value, note}) =>
      h('div', {attributes: {title: note}}, h('dd', {}, value), h('dt', {}, label)))) : h('div', {class: 'summary'}),
    h('div', {class: 'row'}, themeButton, button('Keys', () => help.toggle(), {title: 'Keys (?)'})));
}
