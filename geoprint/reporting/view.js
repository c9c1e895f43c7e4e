// One backend of a scene in its own plot.

class View {
  constructor(root, place, scene) {
    this.root = root;
    this.place = place;
    this.scene = scene;
    this.plot = root.querySelector(".plot");
    this.live = false;
    this.work = Promise.resolve();
    this.listen();
  }

  get replay() {
    return this.scene.part.backends[this.place].replay;
  }

  // How part and table stand at the moment that is shown.
  get stand() {
    const { robot, time } = this.scene.state;
    return robot && this.replay ? standing(this.replay, time) : AT_REST;
  }

  drawn() {
    const { part, state } = this.scene, backend = part.backends[this.place];
    this.stood = this.stand.frame;
    this.colouring = colouringOf(part, backend, state.colour);
    const { clientWidth: width, clientHeight: height } = this.plot;
    const list = traces(part, backend, this.colouring, state, height);
    return [this.plot, list, { ...layout(part, state), width, height }, CONFIG];
  }

  // What plotly.js is to do, one after the other: it does not bear to be purged while it draws.
  queue(task) {
    this.work = this.work.catch(() => {}).then(task);
    return this.work;
  }

  start() {
    this.started = true;
    return this.queue(() => (this.started ? Plotly.newPlot(...this.drawn()) : null)).then((plot) => {
      if (!plot || !this.started) return;
      if (plot.querySelector(".no-webgl")) throw new Error("WebGL is missing");
      this.live = true;
      this.root.classList.add("live");
      plot.on("plotly_relayouting", (change) => this.scene.turn(change["scene.camera"], this));
      plot.on("plotly_relayout", (change) => this.scene.turn(change["scene.camera"], this));
      plot.on("plotly_hover", ({ points: [point] }) => {
        if (point.curveNumber === 0) this.scene.point(this.place, this.vertexOf(point.pointNumber));
      });
      plot.on("plotly_unhover", () => this.scene.point(null));
    });
  }

  // plotly.js counts faces where these carry the colour; a corner stands for its face.
  vertexOf(number) {
    return this.plot.data[0].intensitymode === "cell" ? this.scene.part.faces[0][number] : number;
  }

  // What waits to be drawn is drawn as it is by then: a table that moves asks for more than can be drawn.
  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    this.queue(() => {
      this.waiting = false;
      return this.live && !this.root.hidden ? Plotly.react(...this.drawn()) : null;
    });
  }

  stop() {
    if (!this.started) return;
    this.live = this.started = false;
    this.root.classList.remove("live");
    this.queue(() => Plotly.purge(this.plot));
  }

  turn(camera) {
    if (this.live) Plotly.relayout(this.plot, { "scene.camera": structuredClone(camera) });
  }

  say() {
    const output = this.root.querySelector(".moving"), { robot, time } = this.scene.state;
    if (!robot) { output.textContent = ""; return; }
    if (!this.replay) { output.textContent = "not printable"; return; }
    const now = moment(this.replay, time);
    output.textContent = [...this.attitude(now), `run ${now.run} of ${now.runs}`, `${now.speed.toFixed(0)} mm/s`,
      `valve ${now.valve ? "open" : "shut"}`, ...(now.lamp ? ["lamp on"] : [])].join(" · ");
    output.classList.toggle("laying", now.valve);
  }

  // What is said of the table, if there is one.
  attitude({ turning }) {
    const { table } = this.replay;
    if (!table) return [];
    const { number } = this.stand, count = table.turning.length;
    return [turning ? `table moves to attitude ${number + 1} of ${count}` : `attitude ${number} of ${count}`];
  }

  // Move the robot alone: the surface is not drawn anew.
  move() {
    if (!this.live || !this.replay || !this.scene.state.robot) return;
    // A table that moves moves everything; what is drawn then counts for all that moves until it is there.
    if (this.waiting || this.stand.frame !== this.stood) { this.redraw(); return; }
    const points = movingPlaces(this.scene.part, this.replay, this.scene.state.time, theme());
    const inside = this.plot._fullLayout.scene._scene, full = MOVING.map((place) => this.plot._fullData[place]);
    const held = full.map(({ uid }) => inside?.traces?.[uid]);
    // Through plotly.js's public API every step would upload the surface again, a hundred times slower.
    if (!held.every((trace) => typeof trace?.update === "function")) { this.redraw(); return; }
    held.forEach((trace, at) => {
      const { places: [x, y, z], ...others } = points[at];
      trace.update({ ...full[at], x, y, z, ...others });
      // Nobody points at the robot: without this all is drawn twice, and read back, to know what is where.
      for (const drawn of [trace.mesh, trace.linePlot]) if (drawn) drawn.dirty = false;
      // What is drawn anew when the window changes its size.
      Object.assign(this.plot.data[MOVING[at]], { x, y, z, ...others });
    });
    inside.glplot.redraw();
  }

  listen() {
    const { plot } = this;
    new ResizeObserver(() => {
      const { width, height } = plot._fullLayout ?? {};
      if (this.live && plot.clientWidth && (width !== plot.clientWidth || height !== plot.clientHeight)) this.redraw();
    }).observe(plot);
    // The wheel scrolls the page until the plot has been clicked.
    plot.addEventListener("mousedown", () => plot.focus({ preventScroll: true }), true);
    plot.addEventListener("wheel", (event) => {
      if (document.activeElement !== plot) event.stopPropagation();
    }, true);
    plot.addEventListener("keydown", (event) => {
      if (!this.live || event.ctrlKey || event.altKey || event.metaKey) return;
      const camera = event.key === "Home" ? firstCamera(plot) : cameraAfter(event.key, this.scene.state.camera);
      if (!camera) return;
      event.preventDefault();
      this.scene.turn(camera);
    });
  }
}
