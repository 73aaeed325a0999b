// The pairs that come next, their pictures decoded before they are needed.
const AGAIN_S = [1, 2, 4, 8, 16, 30];

function picture(url, alt) {
  const image = new Image();
  // Painted in the same frame as the text that belongs to it.
  image.decoding = "sync";
  image.draggable = false;
  image.alt = alt;
  image.src = url;
  return image;
}

// null where they can't be loaded.
const filmed = (pictures) =>
  import("./films.js").then(({ load }) => load(pictures.map((url) => `${url}?film`))).catch(() => null);

export class Pair {
  constructor(shown, alts, changed) {
    Object.assign(this, { alts, changed });
    this.load(shown);
  }

  // With fresh addresses a picture that could not be loaded gets another chance.
  load(shown) {
    this.shown = shown;
    this.state = this.state ? "again" : "loading";
    this.images = [picture(shown.a, this.alts.a), picture(shown.b, this.alts.b)];
    const decoded = this.warm();
    this.films = shown.is_filmed ? filmed([shown.a, shown.b]) : null;
    this.films?.then((films) => { this.films = films; });
    decoded.then(() => { this.state = "ready"; }, () => { this.state = "broken"; })
      .then(() => this.changed(this));
    // The original isn't needed for a vote, so it waits for the two that are.
    decoded.then(() => {
      if (shown.original) this.originals = [0, 1].map(() => picture(shown.original, this.alts.original));
    }, () => {});
  }

  // Browsers forget decoded pictures that aren't on the page for a while.
  warm() {
    return Promise.all(this.images.map((image) => image.decode()));
  }
}

export class Pairs {
  #decided = new Set();
  #timer = 0;
  #tries = 0;

  // fetch(n) gives what the server would show next, null without an answer
  constructor(alts, fetch, changed) {
    Object.assign(this, { alts, fetch, changed, list: [], depth: navigator.deviceMemory <= 2 ? 3 : 5 });
  }

  get open() {
    return this.list[0];
  }

  make(shown) {
    return new Pair(shown, this.alts, (pair) => {
      if (pair.state === "broken") this.fillLater();
      this.changed();
    });
  }

  take(shownOnes) {
    this.#tries = 0;
    for (const shown of shownOnes) {
      const held = this.held(shown);
      if (held?.state === "broken") held.load(shown);
      else if (!held && !this.#decided.has(shown.matchup)) this.list.push(this.make(shown));
    }
    this.list.sort((one, other) => one.shown.position - other.shown.position);
    this.changed();
  }

  held({ matchup }) {
    return this.list.find((pair) => pair.shown.matchup === matchup);
  }

  // A pair with a question left: it comes before all others, also after it was decided.
  keep(pair, question) {
    pair.shown.question = question;
    this.#decided.delete(pair.shown.matchup);
    if (!this.held(pair.shown)) this.list.unshift(pair);
  }

  decide(matchup) {
    this.#decided.add(matchup);
    this.list = this.list.filter((pair) => pair.shown.matchup !== matchup);
  }

  // What the server did not take is asked again.
  reopen({ matchup, question }) {
    this.#decided.delete(matchup);
    const held = this.held({ matchup });
    if (held && question) held.shown.question = question;
    this.changed();
  }

  async fill() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    const found = await this.fetch(this.depth);
    if (found) this.take(found);
    else this.fillLater();
    return found;
  }

  fillLater() {
    if (this.#timer) return;
    const wait = AGAIN_S[Math.min(this.#tries, AGAIN_S.length - 1)];
    this.#tries += 1;
    this.#timer = setTimeout(() => this.fill(), wait * 1000);
  }
}
