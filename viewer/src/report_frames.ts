// Frames of a report: hands the row of a frame and its residual to the picture, and says what is known of it.
import type {Context} from './context';
import {isSame, rowOf} from './data/residual';
import {noFacts} from './facts';

export function showReportFrames(context: Context): void {
  const {store, model, view, facts, series, scope, viewport} = context;
  const residuals = new Map<number, Int8Array | Int16Array>();

  const show = (): void => {
    const {clip, frame} = store.now;
    const info = clip >= 0 ? model.meta.clips?.[clip] : undefined;
    if (!info) {
      view.positions.setRow(-1);
      view.positions.setResidual(null, 0);
      facts.set(noFacts);
      viewport.invalidate();
      return;
    }
    view.positions.setRow(info.first_row === null || info.first_row === undefined ? -1 : info.first_row + frame);
    const {residual} = info, values = residuals.get(clip), row = rowOf(info, frame);
    if (residual && values) {
      view.positions.setResidual(row < 0 ? null : values.subarray(row * model.points * 3, (row + 1) * model.points * 3), residual.step);
    } else {
      view.positions.setResidual(null, 0);
    }
    const unknown = model.accelerated && (row < 0 || !values) && !isSame(info, frame);
    facts.set({...series[clip].at(frame), unknown});
    viewport.invalidate();
  };

  const load = async (clip: number): Promise<void> => {
    const blob = model.meta.clips?.[clip]?.residual?.blob;
    if (!blob || residuals.has(clip)) return;
    const values = await model.blob(blob);
    if (!(values instanceof Int8Array) && !(values instanceof Int16Array)) throw new Error('a residual is neither i8 nor i16');
    residuals.set(clip, values);
    show();
  };

  scope.add(store.on(['clip', 'frame'], show));
  scope.add(store.on(['clip'], ({clip}) => void load(clip).catch((error: Error) => context.tell(error.message))));
}
