// What was moved before, step by step: a gesture is one step.
import type {Values} from './client';

const most = 200, together = 800;  // steps; milliseconds between changes of the same controls that are one gesture

export class History {
  private readonly before: Values[] = [];
  private readonly after: Values[] = [];
  private gesture = '';
  private at = -Infinity;

  /** Called before a change. `gesture`: which one; where it is a name of controls, only for as long as they go on changing. */
  note(moved: Values, gesture: string, at: number, goesOn: boolean): void {
    const same = gesture === this.gesture && (goesOn || at - this.at < together);
    this.gesture = gesture;
    this.at = at;
    if (same) return;
    this.before.push(moved);
    if (this.before.length > most) this.before.shift();
    this.after.length = 0;
  }

  /** A gesture that was taken back was none. */
  drop(gesture: string): void {
    if (gesture === this.gesture) this.before.pop();
    this.gesture = '';
  }

  undo(moved: Values): Values | null {
    return this.go(this.before, this.after, moved);
  }

  redo(moved: Values): Values | null {
    return this.go(this.after, this.before, moved);
  }

  private go(from: Values[], to: Values[], moved: Values): Values | null {
    const found = from.pop();
    if (!found) return null;
    to.push(moved);
    this.gesture = '';
    return found;
  }

  get canUndo(): boolean {
    return this.before.length > 0;
  }

  get canRedo(): boolean {
    return this.after.length > 0;
  }
}
