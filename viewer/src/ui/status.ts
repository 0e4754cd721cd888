// The line about the frame that is shown: hit or miss, why, how far off, how long.
import type {Context} from '../context';
import {h} from './dom';
import {duration, length, number} from './format';

const meaning = {hit: 'computed without the full stack', blend: 'in part from the full evaluation', miss: 'evaluated fully'};

export function makeStatus(context: Context): HTMLElement | null {
  const {model, facts, session, scope} = context;
  if (!model.accelerated && !model.live && !model.meta.clips?.some((clip) => clip.full_us)) return null;
  const verdict = h('span', {class: 'verdict'});
  const reason = h('span', {class: 'reason'});
  const most = h('span');
  const figures = h('span', {attributes: {title: 'score: how unlike what was trained; 1 is where a frame misses'}});
  const loop = h('span', {class: 'loop'});
  scope.add(facts.on((known) => {
    verdict.hidden = !known.verdict;
    verdict.textContent = known.verdict ?? '';
    verdict.dataset.verdict = known.verdict ?? '';
    verdict.title = known.verdict ? meaning[known.verdict] : '';
    // of a hit the reason is that word again
    reason.textContent = known.problem ?? (known.reason === known.verdict ? '' : known.reason) ?? '';
    reason.classList.toggle('bad', known.problem !== null);
    const parts: string[] = [];
    most.hidden = known.max_error === null;
    most.textContent = `max ${length(known.max_error, model)}`;
    if (known.rms_error !== null) parts.push(`rms ${length(known.rms_error, model)}`);
    if (known.score !== null) parts.push(`score ${number(known.score)}`);
    if (known.full_us !== null) parts.push(`full ${duration(known.full_us)}`);
    if (known.accelerated_us !== null) parts.push(`accelerated ${duration(known.accelerated_us)}`);
    if (known.unknown) parts.push('no difference stored for this frame');
    figures.textContent = parts.join('  ·  ');
    most.classList.toggle('over', model.tolerance !== null && known.max_error !== null && known.max_error > model.tolerance);
  }));
  if (session) {
    scope.add(session.loopMs.on((ms) => { loop.textContent = ms === null ? '' : `loop ${number(ms)} ms`; }));
    loop.title = 'From the change to the drawn picture';
  }
  return h('div', {class: 'status', attributes: {role: 'status', 'aria-live': 'off'}}, verdict, most, figures, loop, reason);
}
