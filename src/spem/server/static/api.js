/** The server's JSON interface, with errors that can be shown. */

/** What a request came to that did not succeed. */
export class ApiError extends Error {
  constructor(message, status = 0, retryAfter = 0) {
    super(message);
    this.status = status;
    this.retryAfter = retryAfter;
  }
}

/** Address of a path such as "api/info" under the server's root, with parameters; empty ones are left out. */
export function address(path, parameters = {}) {
  const url = new URL(path.replace(/^\//, ""), document.baseURI);
  const model = new URLSearchParams(location.search).get("model");
  const given = { ...parameters };
  if (model && url.pathname.includes("/api/")) given.model ??= model;
  for (const [key, value] of Object.entries(given)) {
    for (const one of Array.isArray(value) ? value : [value]) {
      if (one !== undefined && one !== null && one !== "") url.searchParams.append(key, one);
    }
  }
  return url.href;
}

export const thumbnail = (id) => address(`api/shapes/${encodeURIComponent(id)}/thumbnail.png`);

async function asked(url, options) {
  let response;
  try {
    response = await fetch(url, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError("The server cannot be reached. Is it still running?");
  }
  if (response.ok) return response;
  throw failure(response.status, await response.text(), response.headers.get("Retry-After"));
}

function failure(status, text, retryAfter) {
  let message = "";
  try {
    message = JSON.parse(text).error;
  } catch {
    message = "";
  }
  const seconds = Number(retryAfter) || 0;
  if (!message && status === 429) message = "The server is busy.";
  const more = status === 429 && seconds ? ` Try again in ${seconds} s.` : "";
  return new ApiError((message || `The server answered with status ${status}.`) + more, status, seconds);
}

/** JSON of a path. */
export async function json(path, parameters = {}, signal = undefined) {
  const response = await asked(address(path, parameters), { signal, headers: { Accept: "application/json" } });
  return response.json();
}

/** Body of a path as an ArrayBuffer, as pack_arrays made it. */
export async function bytes(path, parameters = {}, signal = undefined) {
  const response = await asked(address(path, parameters), { signal });
  return response.arrayBuffer();
}

/** Ask that something be removed: a job is cancelled. */
export async function remove(path) {
  await asked(address(path), { method: "DELETE" });
}

let known;

/** What the server holds and takes; asked once for each model. */
export function info() {
  const url = address("api/info");
  if (known?.url !== url) {
    known = { url, promise: json("api/info") };
    known.promise.catch(() => (known = undefined));
  }
  return known.promise;
}

/** Send a file; `onProgress` hears of the share that is sent, and aborting the signal stops it. */
export function upload(path, file, { fields = {}, parameters = {}, onProgress = () => {}, signal } = {}) {
  const form = new FormData();
  for (const [key, value] of Object.entries(fields)) form.append(key, value);
  form.append("file", file, file.name);
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", address(path, parameters));
    request.upload.addEventListener("progress", (event) => {
      if (event.lengthComputable) onProgress(event.loaded / event.total);
    });
    request.addEventListener("load", () => {
      if (request.status < 300) resolve(JSON.parse(request.responseText));
      else reject(failure(request.status, request.responseText, request.getResponseHeader("Retry-After")));
    });
    request.addEventListener("error", () => reject(new ApiError("The file could not be sent.")));
    request.addEventListener("abort", () => reject(new DOMException("cancelled", "AbortError")));
    signal?.addEventListener("abort", () => request.abort());
    request.send(form);
  });
}
