/** A job on the server, followed to its end. */

import { json, remove } from "./api.js";
import { announce, element } from "./dom.js";

const FIRST_WAIT = 150;
const LONGEST_WAIT = 1500;

const pause = (milliseconds, signal) =>
  new Promise((resolve, reject) => {
    const leave = () => {
      clearTimeout(timer);
      reject(new DOMException("left", "AbortError"));
    };
    const timer = setTimeout(() => {
      signal.removeEventListener("abort", leave);
      resolve();
    }, milliseconds);
    signal.addEventListener("abort", leave, { once: true });
  });

/** Follow a job until it is done and return it; `show` hears of each state on the way. */
export async function follow(id, show, signal) {
  let wait = FIRST_WAIT;
  for (;;) {
    let job;
    try {
      job = await json(`api/jobs/${encodeURIComponent(id)}`, {}, signal);
    } catch (error) {
      if (error.status !== 429) throw error;
      await pause(1000 * Math.max(error.retryAfter, 1), signal);
      continue;
    }
    if (!["queued", "running"].includes(job.state)) return job;
    show(job);
    await pause(wait, signal);
    wait = Math.min(wait * 1.3, LONGEST_WAIT);
  }
}

/** What a job is at, in words. */
export function described({ state, stage, position }) {
  if (state === "queued") {
    if (position > 1) return `Waiting: ${position - 1} before this one`;
    return "Waiting for its turn";
  }
  return stage ? stage[0].toUpperCase() + stage.slice(1) : "Working";
}

/** A bar with words and a button to cancel; `show` takes the states of a job. */
export function progressOf(id) {
  const text = element("p", { class: "stage" }, "Waiting for the server");
  const bar = element("progress", { max: 1, "aria-label": "Progress of the search" });
  const cancel = async () => {
    button.disabled = true;
    text.textContent = "Cancelling";
    await remove(`api/jobs/${encodeURIComponent(id)}`).catch(() => {});
  };
  const button = element("button", { type: "button", class: "button small", onclick: cancel }, "Cancel");
  const box = element("div", { class: "progress" }, text, bar, button);
  const show = (job) => {
    const words = described(job);
    if (!button.disabled && text.textContent !== words) {
      text.textContent = words;
      announce(words);
    }
    if (job.state === "running" && job.progress > 0) bar.value = job.progress;
    else bar.removeAttribute("value");
  };
  return { box, show };
}
