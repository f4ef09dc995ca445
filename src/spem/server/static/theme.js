// Runs before the first paint, so that a chosen theme does not flash; a plain script for that reason.
(() => {
  const KEY = "spem-theme";
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");

  function stored() {
    try {
      const theme = localStorage.getItem(KEY);
      return ["light", "dark"].includes(theme) ? theme : null;
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

  function use(theme) {
    root.dataset.theme = theme;
    const button = document.getElementById("theme");
    button?.setAttribute("aria-label", theme === "dark" ? "Use the light theme" : "Use the dark theme");
    button?.setAttribute("title", button.getAttribute("aria-label"));
    // Canvases take their colours anew.
    dispatchEvent(new CustomEvent("spem-theme", { detail: theme }));
  }

  const wished = () => stored() ?? (dark.matches ? "dark" : "light");

  use(wished());
  dark.addEventListener("change", () => use(wished()));
  document.addEventListener("DOMContentLoaded", () => {
    use(wished());
    document.getElementById("theme").addEventListener("click", () => {
      const theme = root.dataset.theme === "dark" ? "light" : "dark";
      keep(theme);
      use(theme);
    });
  });
})();
