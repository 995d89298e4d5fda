// Writes the words of the page and draws its plots.
(() => {
  const content = JSON.parse(byId("content").textContent);
  const MOST_COLUMNS = 1600;

  const series = content.series.map((about, number) => new Series(about, number));
  const [START, END] = content.span[1] > content.span[0] ? content.span : [content.span[0], content.span[0] + 1];
  const shown = { from: START, to: END };
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  // One line through least and greatest: a single sample stays visible however many share its column.
  function line(seen, period) {
    if (seen.every === 1) return { x: seen.x, y: seen.high };
    const x = [], y = [], quarter = (seen.every * period) / 4;
    seen.x.forEach((time, i) => {
      x.push(time - quarter, time + quarter);
      y.push(...(seen.lowFirst[i] ? [seen.low[i], seen.high[i]] : [seen.high[i], seen.low[i]]));
    });
    return { x, y };
  }

  // Closed outlines, one for every stretch without gaps: a fill between two lines would run across them.
  function outline(below, above) {
    const x = [], y = [];
    let run = [];
    const close = () => {
      if (run.length > 1) {
        for (const i of run) { x.push(above.x[i]); y.push(above.high[i]); }
        for (const i of run.slice().reverse()) { x.push(below.x[i]); y.push(below.low[i]); }
        x.push(null); y.push(null);
      }
      run = [];
    };
    for (let i = 0; i < Math.min(below.x.length, above.x.length); i++) {
      if (below.low[i] === null || above.high[i] === null) close(); else run.push(i);
    }
    close();
    return { x, y };
  }

  function stretches(flags, from, to, columns) {
    const seen = flags.view(from, to, columns);
    const half = (seen.every * flags.period) / 2;
    const runs = [];
    seen.x.forEach((time, i) => {
      if (!(seen.high[i] > 0.5)) return;
      const previous = runs[runs.length - 1];
      if (previous && time - half <= previous[1] + half / 4) previous[1] = time + half;
      else runs.push([time - half, time + half]);
    });
    return { runs, missesLevels: seen.missesLevels };
  }

  function yRange(traces, isRobust) {
    const values = traces.flatMap((trace) => trace.y.filter((value) => value !== null && Number.isFinite(value))).sort((a, b) => a - b);
    if (!values.length) return [0, 1];
    const at = (share) => values[Math.round(share * (values.length - 1))];
    const [low, high] = isRobust ? [at(0.01), at(0.99)] : [values[0], values[values.length - 1]];
    const room = (high - low) * (isRobust ? 0.3 : 0.07) || Math.abs(high) * 0.1 || 1;
    return [low - room, high + room];
  }

  const isTouch = matchMedia("(pointer: coarse)").matches;
  const CONFIG = { displayModeBar: false, doubleClick: false, responsive: true };

  class Chart {
    constructor(about, place) {
      this.about = about;
      this.isRobust = Boolean(about.robust);
      this.isStale = true;
      this.isNear = false;
      this.drawn = Promise.resolve();
      this.strips = about.strips ?? [];
      const card = document.createElement("article");
      card.className = "chart";
      const head = document.createElement("div");
      head.className = "head";
      const title = document.createElement("h3");
      title.textContent = about.title + " ";
      if (about.unit) title.append(Object.assign(document.createElement("span"), { textContent: about.unit }));
      head.append(title);
      if (about.second !== undefined) this.key(head, "recorded", "recorded", true), this.key(head, "found", "predicted", true);
      if (about.band) this.key(head, "found", "identified", true), this.key(head, "band", "± 2 standard errors");
      if (about.shade !== null && about.shade !== undefined) this.key(head, "shade", "flagged");
      if (about.robust) head.append(this.scaleButton());
      this.div = document.createElement("div");
      this.div.className = "plot";
      this.div.setAttribute("role", "img");
      this.div.setAttribute("aria-label", `${about.title} over time`);
      if (this.strips.length) this.div.style.height = `${44 + 40 * this.strips.length}px`;
      card.append(head, this.div);
      place.append(card);
    }

    key(head, name, words, isThin) {
      const mark = document.createElement("i");
      mark.style.background = `var(--${name})`;
      if (isThin) mark.className = "thin";
      const key = document.createElement("span");
      key.className = "key";
      key.append(mark, words);
      head.append(key);
    }

    scaleButton() {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: "all values" });
      button.title = "the scale leaves out a hundredth of the values on each side";
      button.addEventListener("click", () => {
        this.isRobust = !this.isRobust;
        button.textContent = this.isRobust ? "all values" : "most values";
        this.isStale = true;
        this.draw();
      });
      return button;
    }

    draw() {
      if (!this.isStale || !this.isNear) return this.drawn;
      this.isStale = false;
      const { from, to } = shown;
      const columns = Math.min(MOST_COLUMNS, Math.max(200, this.div.clientWidth - 80));
      const misses = [];
      const view = (number) => {
        const seen = series[number].view(from, to, columns);
        if (seen.missesLevels) misses.push(number);
        return seen;
      };
      const traces = [], shapes = [];
      const rectangle = (run, rest) => ({ type: "rect", x0: run[0], x1: run[1], line: { width: 0 }, layer: "below", ...rest });
      if (this.about.line !== undefined) {
        const seen = view(this.about.line);
        this.every = seen.every * series[this.about.line].period;
        if (this.about.band) {
          const [below, above] = this.about.band.map(view);
          traces.push({ ...outline(below, above), mode: "lines", line: { width: 0 }, fill: "toself", fillcolor: colour("band"), hoverinfo: "skip" });
        }
        const isFew = seen.every === 1 && seen.x.length < columns / 6;
        traces.push({
          ...line(seen, series[this.about.line].period), mode: isFew ? "lines+markers" : "lines", marker: { size: 4 },
          line: { width: this.about.second === undefined ? 1.15 : 2.2, color: colour(this.about.band ? "found" : "recorded") }, hovertemplate: "%{y:.6g}<extra></extra>",
        });
        if (this.about.second !== undefined) {
          traces.push({
            ...line(view(this.about.second), series[this.about.second].period), mode: "lines",
            line: { width: 1.1, color: colour("found") }, hovertemplate: "%{y:.6g}<extra></extra>",
          });
        }
      }
      if (this.about.shade !== null && this.about.shade !== undefined) {
        const { runs, missesLevels } = stretches(series[this.about.shade], from, to, columns);
        if (missesLevels) misses.push(this.about.shade);
        for (const run of runs) shapes.push(rectangle(run, { yref: "paper", y0: 0, y1: 1, fillcolor: colour("shade") }));
      }
      this.strips.forEach((strip, row) => {
        const { runs, missesLevels } = stretches(series[strip.series], from, to, columns);
        if (missesLevels) misses.push(strip.series);
        // Something that short is still drawn a pixel wide.
        const least = (to - from) / columns;
        for (const [begin, end] of runs) {
          const wider = Math.max(0, least - (end - begin)) / 2;
          shapes.push(rectangle([begin - wider, end + wider], { y0: row, y1: row + 0.4, fillcolor: colour("strip") }));
        }
      });
      if (this.strips.length) traces.push({ x: [from], y: [0], mode: "markers", marker: { opacity: 0 }, hoverinfo: "skip" });
      this.drawn = Plotly.react(this.div, traces, this.layout(traces, shapes), { ...CONFIG, staticPlot: isTouch }).then(() => this.listen());
      if (misses.length) {
        this.drawn = this.drawn.then(() => Promise.all(misses.map((number) => series[number].readLevels()))).then(() => {
          this.isStale = true;
          // Out of sight meanwhile, draw() would give back the very promise that waits for it.
          return this.isNear ? this.draw() : undefined;
        });
      }
      return this.drawn;
    }

    layout(traces, shapes) {
      const ink = colour("muted"), grid = colour("grid");
      const line = traces.filter((trace) => trace.fill === undefined);
      const names = this.strips.map((one) => one.flag.replaceAll("_", " ").toLowerCase());
      const ofStrips = { range: [names.length - 0.5, -0.5], tickvals: [], showgrid: false };
      // Above their strips, so that times stand where they do in every other plot.
      const annotations = names.map((text, row) => ({ text, xref: "paper", x: 0, xanchor: "left", y: row - 0.22, yanchor: "middle", showarrow: false }));
      // An empty plot looks as if something were broken.
      if (!this.strips.length && !line.some((trace) => trace.y.some((value) => value !== null && Number.isFinite(value)))) {
        annotations.push({ text: "no numbers here", xref: "paper", x: 0.5, yref: "paper", y: 0.5, showarrow: false });
      }
      const ofLine = { range: line.length ? yRange(line, this.isRobust) : [0, 1], nticks: 5, gridcolor: grid, exponentformat: "power" };
      // Marks that are not seen keep the two axes' words apart where they meet.
      const apart = { ticks: "outside", tickcolor: "rgba(0,0,0,0)" };
      return {
        margin: { l: 64, r: 18, t: 10, b: 34 },
        paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
        font: { color: ink, size: 12, family: getComputedStyle(document.body).fontFamily },
        // Without a sign between thousands: plotly writes one in times with a fraction alone.
        separators: ".",
        showlegend: false, hovermode: "x", dragmode: isTouch ? false : "zoom", shapes, annotations,
        hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
        xaxis: { ...apart, ticklen: 9, range: [shown.from, shown.to], ticksuffix: " s", gridcolor: grid, zeroline: false, exponentformat: "none", separatethousands: false, hoverformat: ".6f", nticks: Math.max(3, Math.round(this.div.clientWidth / 120)) },
        yaxis: { ...apart, ticklen: 4, fixedrange: true, zeroline: false, automargin: false, ...(this.strips.length ? ofStrips : ofLine) },
      };
    }

    listen() {
      if (this.isListening) return;
      this.isListening = true;
      this.div.on("plotly_relayout", (change) => {
        const range = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
        if (range[0] !== undefined) show(Number(range[0]), Number(range[1]));
      });
      this.div.on("plotly_doubleclick", () => show(START, END));
    }
  }

  const charts = [];

  function number(value) {
    return String(Number(value.toFixed(Math.max(0, Math.min(9, 3 - Math.floor(Math.log10((shown.to - shown.from) || 1)))))));
  }

  // Shows a stretch of time in all plots; those that are out of sight follow when they come near.
  async function show(from, to) {
    const least = 4 * Math.min(...series.map((one) => one.period));
    if (!Number.isFinite(from) || !Number.isFinite(to)) [from, to] = [shown.from, shown.to];
    if (to < from) [from, to] = [to, from];
    const width = Math.min(Math.max(to - from, least), END - START);
    const middle = Math.min(Math.max((from + to) / 2, START + width / 2), END - width / 2);
    Object.assign(shown, { from: middle - width / 2, to: middle + width / 2 });
    byId("from").value = number(shown.from);
    byId("to").value = number(shown.to);
    for (const chart of charts) chart.isStale = true;
    await Promise.all(charts.map((chart) => chart.draw()));
    const finest = Math.min(...charts.filter((one) => one.isNear && one.every).map((one) => one.every));
    byId("detail").textContent = Number.isFinite(finest)
      ? (finest <= 1.001 * Math.min(...series.map((one) => one.period)) ? "every sample is drawn" : `least and greatest of every ${Number(finest.toPrecision(3))} s`) : "";
  }

  function element(name, text, className) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  }

  // A number stays on one line with its sign and its percent.
  function together(made, text) {
    const parts = text.split(/(± \S+(?: %)?|\S+ %)/);
    made.replaceChildren(...parts.map((part, place) => (place % 2 ? element("span", part, "together") : part)));
    return made;
  }

  const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1) + (/[.?!]$/.test(text) ? "" : ".");

  function timeButton(from, to) {
    const round = (value) => Number(value.toFixed(3));
    const button = element("button", from === to ? `${round(from)} s` : `${round(from)} – ${round(to)} s`);
    button.type = "button";
    button.title = "show this time in the plots";
    button.addEventListener("click", () => {
      const room = Math.max(to - from, (END - START) / 500);
      byId("plots").scrollIntoView({ behavior: "smooth" });
      show(from - room, to + room);
    });
    return button;
  }

  function write() {
    byId("verdict").classList.add(content.tone);
    const verdict = byId("verdict").lastElementChild;
    together(verdict, verdict.textContent);
    byId("sign").textContent = { good: "✓", doubtful: "!", bad: "✕" }[content.tone];
    const first = content.series[0];
    if (first) byId("facts").textContent = content.facts ?? `${first.count.toLocaleString("en").replaceAll(",", "\u202f")} samples, ${Number((END - START).toPrecision(4))} s`;
    for (const one of content.numbers) {
      const card = element("div", undefined, "number");
      const [middle, error] = one.value.split(" ± ");
      const value = element("p", middle + " ", "value");
      value.append(element("small", error ? `± ${error} ${one.unit}` : one.unit));
      card.append(element("h3", one.name), value, element("p", one.kind));
      if (one.more) card.append(element("p", one.more));
      byId("numbers").append(card);
    }
    byId("advice").hidden = !content.advice.length;
    for (const words of content.advice) byId("advice-list").append(together(element("li"), sentence(words)));
    byId("warnings").hidden = !content.warnings.length && !content.jumps.length;
    for (const one of content.warnings) {
      const card = element("div", undefined, "warning");
      const where = element("p", one.where, "where");
      const times = element("span", undefined, "times");
      for (const [from, to] of one.times) times.append(timeButton(from, to));
      where.append(" ", times);
      if (one.more) where.append(` and ${one.more} shorter ones`);
      card.append(element("p", sentence(one.words)), where);
      byId("warning-list").append(card);
    }
    if (content.jumps.length) {
      const card = element("div", undefined, "warning"), times = element("span", undefined, "times");
      for (const time of content.jumps) times.append(timeButton(time, time));
      card.append(element("p", "Parameters jump; below it is said which."), times);
      byId("warning-list").append(card);
    }
    for (const words of content.reasons) byId("reasons").append(element("li", sentence(words)));
    for (const [name, value] of content.settings) {
      const row = element("tr");
      row.append(element("td", name), element("td", value));
      byId("settings").tBodies[0].append(row);
    }
    byId("repeat").textContent = content.repeat;
    byId("repeat").closest("details").hidden = !content.repeat;
    byId("foot").textContent = `${content.detail} Written by tvident ${content.version}. This page needs no network and loads nothing.`.trim();
    if (isTouch) byId("how").textContent = "Look closer with the buttons, or give the times. All plots show the same time.";
  }

  function tools() {
    for (const button of document.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", () => {
        const middle = (shown.from + shown.to) / 2, half = ((shown.to - shown.from) / 2) * Number(button.dataset.zoom);
        show(middle - half, middle + half);
      });
    }
    for (const button of document.querySelectorAll("[data-move]")) {
      button.addEventListener("click", () => {
        const by = (shown.to - shown.from) * Number(button.dataset.move);
        show(shown.from + by, shown.to + by);
      });
    }
    byId("whole").addEventListener("click", () => show(START, END));
    for (const id of ["from", "to"]) byId(id).addEventListener("change", () => show(Number(byId("from").value), Number(byId("to").value)));
    const again = () => { for (const chart of charts) { chart.isStale = true; chart.draw(); } };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
    let waiting;
    addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(again, 150); });
  }

  async function begin() {
    write();
    if (typeof DecompressionStream === "undefined") throw new Error("This browser is too old for the plots: Chrome 80, Firefox 113 or Safari 16.4 draw them.");
    const plotly = inflated("plotly").then((bytes) => {
      const script = document.createElement("script");
      script.textContent = new TextDecoder().decode(bytes);
      document.head.append(script);
    });
    await Promise.all([plotly, ...series.map((one) => one.readExtremes())]);
    let group = "";
    for (const about of content.charts) {
      if (about.group !== group) byId("charts").append(element("h3", (group = about.group), "group"));
      charts.push(new Chart(about, byId("charts")));
    }
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        const chart = charts.find((one) => one.div === entry.target);
        chart.isNear = entry.isIntersecting;
        chart.draw();
      }
    }, { rootMargin: "300px" });
    for (const chart of charts) {
      const { top, bottom } = chart.div.getBoundingClientRect();
      chart.isNear = top < innerHeight + 300 && bottom > -300;
      watch.observe(chart.div);
    }
    tools();
    await show(START, END);
    document.body.dataset.usable = String(Math.round(performance.now()));
    // What zooming needs is read while nobody waits for it.
    for (const one of series) {
      await new Promise((resolve) => setTimeout(resolve, 0));
      await one.readLevels();
    }
    document.body.dataset.complete = "yes";
  }

  begin().catch((error) => {
    byId("trouble").hidden = false;
    byId("trouble").textContent = error.message;
    throw error;
  });
  window.tvidentReport = { show, shown, charts };
})();
