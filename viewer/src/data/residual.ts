// What a report knows of the difference of a frame.
import type {ClipInfo} from './meta';

/** Which row of its clip's residual a frame has, or -1. */
export const rowOf = ({residual}: ClipInfo, frame: number): number => !residual ? -1 : residual.rows ? residual.rows[frame] : frame;

/** Whether the two sides are the same without anything being stored. */
export const isSame = (clip: ClipInfo, frame: number): boolean => clip.verdicts?.[frame] === 2 || clip.max_error?.[frame] === 0;
