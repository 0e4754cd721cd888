// Play, step, the slider of frames, and the strip of hits, blends and misses under it.
import type {Context} from '../context';
import {chooseClip, framesOf, step} from '../player';
import {button, h, onceAFrame, setPressed, themeColour} from './dom';
import {length} from './format';

export function makeTimeline(context: Context): HTMLElement | null {
  const {store, model, series, facts, scope} = context;
  const clips = model.meta.clips ?? [];
  if (!clips.length) return null;

  const playButton = button('Play', () => store.set({playing: !store.now.playing}), {title: 'Play or pause (Space)', class: 'play'});
  const loopButton = button('Loop', () => store.set({loop: !store.now.loop}), {title: 'Begin again at the end (L)', pressed: true});
  const choice = h('select', {attributes: {'aria-label': 'Clip'}, on: {change: () => chooseClip(store, model, Number(choice.value))}},
    model.live || !model.shape ? h('option', {attributes: {value: -1}}, 'No clip') : null,
    ...clips.map((clip, i) => h('option', {attributes: {value: i}}, clip.test ? `${clip.name} (test)` : clip.name)));
  const slider = h('input', {
    class: 'frames', attributes: {type: 'range', min: 0, max: 0, step: 1, 'aria-label': 'Frame'},
    on: {input: () => store.set({playing: false, frame: Number(slider.value)})},
  });
  const place = h('output', {class: 'place'});
  const strip = h('canvas', {class: 'strip', attributes: {height: 10, role: 'img', 'aria-label': 'Hits, blends and misses'}});
  const hint = h('div', {class: 'hint', attributes: {hidden: true}});
  const track = h('div', {class: 'track'}, slider, strip, hint);

  const frameAt = (event: PointerEvent): number => {
    const box = strip.getBoundingClientRect();
    const frames = framesOf(model, store.now.clip);
    return Math.min(frames - 1, Math.max(0, Math.floor((event.clientX - box.left) / box.width * frames)));
  };
  strip.addEventListener('pointermove', (event) => {
    const {clip} = store.now;
    if (clip < 0) return;
    const frame = frameAt(event), known = series[clip].at(frame);
    hint.textContent = [`frame ${frame}`, known.verdict, known.reason, known.max_error !== null && `max error ${length(known.max_error, model)}`]
      .filter(Boolean).join(' - ');
    hint.hidden = false;
    const width = strip.clientWidth, x = event.clientX - strip.getBoundingClientRect().left;
    hint.style.left = `${Math.max(0, Math.min(width - hint.offsetWidth, x - hint.offsetWidth / 2))}px`;
  });
  strip.addEventListener('pointerleave', () => { hint.hidden = true; });
  strip.addEventListener('pointerdown', (event) => { if (store.now.clip >= 0) store.set({playing: false, frame: frameAt(event)}); });

  const paint = onceAFrame(() => {
    const {clip} = store.now, frames = framesOf(model, clip), brush = strip.getContext('2d');
    const width = Math.round(strip.clientWidth * devicePixelRatio), height = Math.round(strip.clientHeight * devicePixelRatio);
    if (!brush || !width) return;
    strip.width = width;
    strip.height = height;
    const colours = {hit: themeColour('--hit'), blend: themeColour('--blend'), miss: themeColour('--miss')};
    for (let i = 0; i < frames; ++i) {
      const verdict = series[clip].verdicts[i];
      if (!verdict) continue;
      brush.fillStyle = colours[verdict];
      const from = Math.round(i / frames * width), to = Math.max(from + 1, Math.round((i + 1) / frames * width));
      const tall = verdict === 'hit' ? 0.5 : verdict === 'blend' ? 0.75 : 1;
      brush.fillRect(from, height * (1 - tall), to - from, height * tall);
    }
  });
  const resized = new ResizeObserver(paint);
  resized.observe(strip);
  scope.add(() => resized.disconnect());

  scope.add(store.on(['clip', 'frame', 'playing', 'loop'], ({clip, frame, playing, loop}) => {
    const frames = framesOf(model, clip);
    slider.max = String(Math.max(0, frames - 1));
    slider.value = String(frame);
    track.hidden = frames < 1;
    slider.disabled = frames < 2;
    playButton.disabled = frames < 2;
    choice.value = String(clip);
    playButton.textContent = playing ? 'Pause' : 'Play';
    setPressed(loopButton, loop);
    place.textContent = frames ? `${frame} / ${frames - 1}` : 'no clip';
    slider.setAttribute('aria-valuetext', frames ? `frame ${frame} of ${frames}` : 'no clip');
  }));
  const known = model.accelerated && (model.live || series.some((s) => s.has('verdicts')));
  strip.hidden = !known;
  scope.add(store.on(['clip'], paint));
  if (model.live) scope.add(facts.on(paint));
  document.addEventListener('kpsa-theme', paint);
  scope.add(() => document.removeEventListener('kpsa-theme', paint));

  return h('section', {class: 'timeline', attributes: {'aria-label': 'Timeline'}},
    h('div', {class: 'row'}, playButton,
      button('‹', () => step(store, model, -1), {title: 'One frame back (left arrow)'}),
      button('›', () => step(store, model, 1), {title: 'One frame on (right arrow)'}),
      loopButton, choice, place),
    track);
}
