// Follows the rig file: asks for what has changed, again and again, and tells.
import type {Problem} from '../data/meta';
import {Refused, type Client} from './client';

export interface EventCalls {
  problems(problems: readonly Problem[]): void;
  generation(generation: number): void;
  connection(lost: boolean): void;
}

export async function follow(client: Client, calls: EventCalls): Promise<void> {
  let serial = -1, lost = false;
  for (;;) {
    try {
      const events = await client.events(serial);
      if (lost) calls.connection(false);
      lost = false;
      serial = events.serial;
      calls.problems(events.problems);
      calls.generation(events.generation);
    } catch (error) {
      if (error instanceof Refused && (error.status === 403 || error.status === 404)) return calls.problems(error.problems);
      if (!lost) calls.connection(true);
      lost = true;
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
}
