// What the parts of the page share.
import type {Model} from './data/model';
import type {Facts, Series, Signal} from './facts';
import type {Session} from './live/session';
import type {Scope, Store} from './state';
import type {ModelView} from './view/model_view';
import type {Viewport} from './view/viewport';

export interface Context {
  store: Store;
  model: Model;
  viewport: Viewport;
  view: ModelView;
  series: readonly Series[];
  facts: Signal<Facts>;
  session: Session | null;  // live only
  scope: Scope;             // ends when the rig is replaced by a new version
  /** A short text for the user, read out as well. */
  tell(text: string): void;
  /** Shows one of the panels. */
  open(panel: string): void;
}
