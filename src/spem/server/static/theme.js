// Runs before the first paint, so that a chosen theme does not flash; a plain script for that reason.
(() => {
  const KEY = "spem-theme";
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");

  function stored() {
    try {
      return localStorage.getItem(KEY);
    } catch {
      return null; // Storage is closed to pages in some private windows.
    }
  }

  function keep(theme) {
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // The choice then lasts as long as the page.
    }
  }

  const theme = () => root.dataset.theme ?? (dark.matches ? "dark" : "light");

  function tell() {
    const button = document.getElementById("theme");
    button?.setAttribute("aria-label", theme() === "dark" ? "Use the light theme" : "Use the dark theme");
    button?.setAttribute("title", button.getAttribute("aria-label"));
    // Canvases take their colours anew.
    dispatchEvent(new CustomEvent("spem-theme", { detail: theme() }));
  }

  const chosen = stored();
  if (chosen === "light" || chosen === "dark") root.dataset.theme = chosen;
  dark.addEventListener("change", tell);
  document.addEventListener("DOMContentLoaded", () => {
    tell();
    document.getElementById("theme").addEventListener("click", () => {
      root.dataset.theme = theme() === "dark" ? "light" : "dark";
      keep(root.dataset.theme);
      tell();
    });
  });
})();
