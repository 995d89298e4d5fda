"use strict";
// Unpacks the series of the page, and gives of each what the time that is shown needs.

const byId = (id) => document.getElementById(id);

async function inflated(id) {
  const holder = byId(id);
  const text = atob(holder.textContent);
  holder.remove(); // once is enough, and it is long
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

class Series {
  constructor(about, number) {
    Object.assign(this, about);
    this.number = number;
    this.blocks = Math.ceil(this.count / this.block);
    this.end = this.start + (this.count - 1) * this.period;
    this.levels = null;
  }

  async readExtremes() {
    const both = new Float32Array(await inflated(`extremes-${this.number}`));
    this.low = both.subarray(0, this.blocks);
    this.high = both.subarray(this.blocks);
  }

  readLevels() {
    this.reading ??= (async () => {
      const bytes = new Uint8Array(await inflated(`levels-${this.number}`));
      const size = this.blocks * this.block;
      const wide = this.top > 255;
      const levels = wide ? new Uint16Array(size) : bytes;
      if (wide) for (let i = 0; i < size; i++) levels[i] = bytes[i] | (bytes[size + i] << 8);
      if (this.differences) for (let i = 1; i < size; i++) levels[i] = levels[i] + levels[i - 1];
      this.levels = levels;
    })();
    return this.reading;
  }

  sample(i) {
    const level = this.levels[i];
    if (level > this.top) return NaN;
    const block = Math.floor(i / this.block);
    const low = this.low[block];
    const relative = level === this.top ? this.high[block] : low + ((this.high[block] - low) * level) / this.top;
    return this.middle + this.factor * relative;
  }

  // What is seen between two times: for each column its least and greatest sample, or every sample where there is room.
  view(from, to, columns) {
    const clipped = (i) => Math.min(Math.max(i, 0), this.count - 1);
    const first = clipped(Math.floor((from - this.start) / this.period) - 1);
    const last = clipped(Math.ceil((to - this.start) / this.period) + 1);
    const samples = last - first + 1;
    if (this.count === 0) return { x: [], low: [], high: [], unit: 0 };
    const fine = this.levels !== null && samples <= columns * this.block;
    const wanted = samples <= columns * this.block;
    const seen = fine ? this.ofSamples(first, last, columns) : this.ofBlocks(first, last, columns);
    seen.missesLevels = wanted && !fine;
    return seen;
  }

  ofSamples(first, last, columns) {
    const samples = last - first + 1;
    const every = samples <= 2 * columns ? 1 : Math.ceil(samples / columns);
    const seen = { x: [], low: [], high: [], every };
    // Columns begin at multiples, so that nothing flickers while the time is moved.
    for (let begin = first - (first % every); begin <= last; begin += every) {
      const end = Math.min(begin + every, this.count);
      let low = Infinity, high = -Infinity, isLowFirst = true;
      for (let i = begin; i < end; i++) {
        const value = this.sample(i);
        if (value < low) { low = value; isLowFirst = false; }
        if (value > high) { high = value; isLowFirst = true; }
      }
      this.push(seen, begin, end, low, high, isLowFirst);
    }
    return seen;
  }

  ofBlocks(first, last, columns) {
    const from = Math.floor(first / this.block), to = Math.floor(last / this.block);
    const every = Math.max(1, Math.ceil((to - from + 1) / columns));
    const seen = { x: [], low: [], high: [], every: every * this.block };
    for (let begin = from - (from % every); begin <= to; begin += every) {
      const end = Math.min(begin + every, this.blocks);
      let low = Infinity, high = -Infinity;
      for (let i = begin; i < end; i++) {
        if (this.low[i] < low) low = this.low[i];
        if (this.high[i] > high) high = this.high[i];
      }
      const last = Math.min(end * this.block, this.count);
      this.push(seen, begin * this.block, last, this.middle + this.factor * low, this.middle + this.factor * high, true);
    }
    return seen;
  }

  push(seen, begin, end, low, high, isLowFirst) {
    const there = low <= high;
    seen.x.push(this.start + ((begin + end - 1) / 2) * this.period);
    seen.low.push(there ? low : null);
    seen.high.push(there ? high : null);
    (seen.lowFirst ??= []).push(isLowFirst);
  }
}
