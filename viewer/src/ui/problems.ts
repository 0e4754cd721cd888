// What is wrong with the rig file while the last good rig goes on.
import type {Problem} from '../data/meta';
import {h} from './dom';

export class ProblemList {
  readonly element = h('section', {class: 'problems', attributes: {role: 'alert', hidden: true, 'aria-label': 'Problems'}});

  set(problems: readonly Problem[], aside?: string): void {
    this.element.hidden = !problems.length;
    if (!problems.length) return this.element.replaceChildren();
    this.element.replaceChildren(
      h('h2', {}, problems.length === 1 ? 'A problem' : `${problems.length} problems`, aside ? h('small', {}, aside) : null),
      h('ol', {}, ...problems.slice(0, 50).map((problem) => h('li', {class: problem.severity === 'warning' ? 'warning' : undefined},
        h('code', {}, [problem.file, problem.line, problem.column].filter((part) => part !== null && part !== undefined).join(':')),
        h('span', {}, problem.message),
        problem.suggestion ? h('em', {}, problem.suggestion) : null))));
  }
}
