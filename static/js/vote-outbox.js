// Votes and reports on their way to the server, kept in this browser until the server confirms.
// Every entry has a key of its own, so that sending one twice stores it once.
const WAITS_S = [0.5, 1, 2, 4, 8, 16, 30];
const PATIENCE_MS = 20_000;

function cookie(name) {
  return document.cookie.match(`(?:^|; )${name}=([^;]*)`)?.[1] ?? "";
}

// {status, body, after}: status 0 stands for no answer, or one that is not ours.
export async function ask(url, sent) {
  const headers = { Accept: "application/json" };
  const request = { headers, signal: AbortSignal.timeout(PATIENCE_MS) };
  if (sent) {
    Object.assign(request, { method: "POST", keepalive: true, body: JSON.stringify(sent) });
    headers["Content-Type"] = "application/json";
    // Read anew each time: signing in again in another tab changes it.
    headers["X-CSRFToken"] = cookie("csrftoken");
  }
  try {
    const answer = await fetch(url, request);
    return { status: answer.status, body: await answer.json(), after: answer.headers.get("Retry-After") };
  } catch {
    return { status: 0 };
  }
}

export class Outbox {
  #memory = [];
  #isKept = true;
  #isSending = false;
  #isStopped = true;
  #failures = 0;
  #timer = 0;

  // told: wanted() = how many pairs to ask for, changed(), saved(entry, body),
  // refused(entry, status, body), stopped(status)
  constructor(name, urls, told) {
    Object.assign(this, { name, urls, told });
    addEventListener("online", () => this.start());
    addEventListener("focus", () => this.start());
  }

  get entries() {
    if (!this.#isKept) return this.#memory;
    try {
      return JSON.parse(localStorage.getItem(this.name) ?? "[]");
    } catch {
      return this.#memory;
    }
  }

  // Before the next pair is shown; what follows a reload finds the entry here.
  add(to, body, shown) {
    this.#keep([...this.entries, { to, body, shown }]);
    setTimeout(() => this.#send());
  }

  start() {
    if (this.isHalted) return;
    this.#isStopped = false;
    this.#failures = 0;
    this.told.changed();
    this.#send();
  }

  halt() {
    this.isHalted = true;
    this.#isStopped = true;
    clearTimeout(this.#timer);
  }

  clear() {
    this.#keep([]);
  }

  #keep(entries) {
    this.#memory = entries;
    try {
      if (entries.length) localStorage.setItem(this.name, JSON.stringify(entries));
      else localStorage.removeItem(this.name);
    } catch {
      // A browser that stores nothing: they live as long as the page.
      this.#isKept = false;
    }
    this.told.changed();
  }

  #drop({ body }) {
    this.#keep(this.entries.filter((entry) => entry.body.key !== body.key));
  }

  // One after the other: a vote that replaces another must come after it.
  async #send() {
    const [entry] = this.entries;
    if (this.#isSending || this.#isStopped || !entry) return;
    clearTimeout(this.#timer);
    this.#isSending = true;
    const more = entry.to === "votes" ? { n: this.told.wanted() } : {};
    const { status, body, after } = await ask(this.urls[entry.to], { ...entry.body, ...more });
    this.#isSending = false;
    if (this.isHalted) return;
    // No answer at all: who is offline is told so.
    this.isCut = !status;
    if (status === 200) {
      this.#failures = 0;
      this.#drop(entry);
      this.told.saved(entry, body);
    } else if ([401, 403, 410].includes(status)) {
      this.#isStopped = true;
      this.told.stopped(status);
    } else if (status >= 400 && status < 500 && status !== 408 && status !== 429) {
      this.#drop(entry);
      this.told.refused(entry, status, body);
    } else {
      const wait = Number(after) || WAITS_S[Math.min(this.#failures, WAITS_S.length - 1)];
      this.#failures += 1;
      this.#timer = setTimeout(() => this.#send(), wait * 1000);
      this.told.changed();
      return;
    }
    this.#send();
  }
}
