// Dark or light: as the system says, until the user chooses.
export type Theme = 'dark' | 'light';

const system = matchMedia('(prefers-color-scheme: dark)');
let chosen: Theme | null = null;

export function theme(): Theme {
  return chosen ?? (system.matches ? 'dark' : 'light');
}

export function applyTheme(next?: Theme): void {
  if (next) chosen = next;
  document.documentElement.dataset.theme = theme();
  document.dispatchEvent(new Event('kpsa-theme'));
}

export function followSystem(): void {
  applyTheme();
  system.addEventListener('change', () => applyTheme());
}
