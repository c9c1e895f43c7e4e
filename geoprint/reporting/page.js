// The scenes of the page and their controls.

// As many views are kept alive at once; browsers allow about sixteen.
const MOST_LIVE = 12;
// After a longer pause between two frames the replay goes on where it was [ms].
const LONGEST_STEP = 250;
// Where the page is narrower there is room for one view: that of the best backend.
const NARROW = matchMedia("(max-width: 640px)");
const DARK = matchMedia("(prefers-color-scheme: dark)");

class Scene {
  constructor(root) {
    this.root = root;
    this.key = root.dataset.part;
    this.status = root.querySelector(".status");
    this.player = root.querySelector("div.player");
    this.views = [...root.querySelectorAll(".view")].map((view, place) => new View(view, place, this));
    this.playing = false;
    this.state = { backend: "all", colour: "spacing", paths: true, layers: 0, robot: false, frame: "part",
      time: Infinity };
    this.listen();
    if (NARROW.matches && this.views.length > 1) {
      const best = this.views.findIndex((view) => view.root.classList.contains("best"));
      this.box("backend", Math.max(best, 0)).checked = true;
    }
    this.arrange();
  }

  // Unpacked when it is first needed: a part far down the page costs nothing until it comes near or is used.
  get part() {
    return this.unpacked ??= unpack(JSON.parse(document.getElementById(`${this.key}-data`).textContent));
  }

  get shown() {
    return this.views.filter(({ root }) => !root.hidden);
  }

  get replays() {
    return this.shown.flatMap(({ replay }) => replay ?? []);
  }

  get end() {
    return Math.max(...this.replays.map(({ times }) => times[times.length - 1]));
  }

  box(name, value) {
    return this.root.querySelector(`[name="${this.key}-${name}"]${value === undefined ? "" : `[value="${value}"]`}`);
  }

  control(name) {
    return this.root.querySelector(`[name="${this.key}-${name}"]:checked`)?.value;
  }

  // Show the views that are asked for.
  arrange() {
    const wanted = this.control("backend");
    this.views.forEach((view, place) => { view.root.hidden = wanted !== "all" && Number(wanted) !== place; });
    this.root.style.setProperty("--columns", Math.min(this.shown.length, 3));
  }

  start() {
    if (this.active || this.failed) return;
    this.active = true;
    this.readControls();
    this.state.camera ??= firstCamera(this.shown[0].plot);
    this.next();
  }

  // Draw the views one by one, the best first, so that the page answers between them.
  next() {
    if (!this.active || this.failed) return;
    const waiting = this.shown.filter((view) => !view.started);
    if (!waiting.length) {
      if (!this.shown.every((view) => view.live)) return;
      this.root.classList.add("live");
      this.status.textContent = "Drag to turn; click once, then scroll to zoom. Keys: arrows, plus, minus, Home. Axes in mm.";
      return;
    }
    const first = waiting.find(({ place }) => place === this.part.winner) ?? waiting[0];
    first.start().then(() => setTimeout(() => this.next())).catch((error) => this.fail(error));
  }

  fail(error) {
    this.failed = true;
    this.root.classList.remove("live");
    this.root.classList.add("failed");
    this.status.textContent = `This browser draws no 3D here (${error.message}); the still picture stands in.`;
  }

  stop() {
    this.pause();
    this.active = false;
    this.views.forEach((view) => view.stop());
    this.root.classList.remove("live");
  }

  // All views turn together.
  turn(camera, from) {
    if (!camera || JSON.stringify(camera) === JSON.stringify(this.state.camera)) return;
    this.state.camera = structuredClone(camera);
    this.shown.filter((view) => view !== from).forEach((view) => view.turn(camera));
  }

  // Say what stands under the pointer.
  point(place, at) {
    const said = place === null ? "" : this.views[place].colouring.said(at);
    this.root.querySelector(".pointed").textContent = said && `${said}; ${placeOf(this.part, at)}`;
  }

  readControls() {
    const { state, part } = this;
    state.colour = this.control("colour");
    state.paths = this.control("paths") !== undefined;
    state.frame = this.control("frame") ?? "part";
    state.robot = this.control("robot") !== undefined;
    this.readLayers();
    this.root.querySelector(".legend").replaceChildren(...scaleOf(colouringOf(part, part.backends[0], state.colour)));
    this.showTime();
  }

  // Of a stack: how many layers of paths are shown.
  readLayers() {
    const slider = this.box("layers");
    if (!slider) return;
    this.state.layers = Number(slider.value);
    const said = this.state.layers ? `${this.state.layers} of ${slider.max}` : "none";
    slider.parentElement.querySelector("output").textContent = said;
    slider.setAttribute("aria-valuetext", said);
  }

  // Show a moment of the replay: on the slider, in words and where the robot is.
  showTime() {
    if (!this.player) return;
    const slider = this.player.querySelector("input"), output = this.player.querySelector("output");
    const still = this.replays.length === 0;
    this.player.querySelectorAll("input, button, select").forEach((control) => { control.disabled = still; });
    this.shown.forEach((view) => view.say());
    if (still) { this.pause(); output.textContent = "not printable"; return; }
    const { end } = this, time = Math.min(this.state.time, end);
    slider.value = (time / end) * Number(slider.max);
    output.textContent = `${time.toFixed(1)} of ${end.toFixed(1)} s`;
    slider.setAttribute("aria-valuetext", output.textContent);
  }

  goTo(time) {
    this.state.time = time < this.end ? time : Infinity;
    this.showTime();
    this.shown.forEach((view) => view.move());
  }

  redraw() {
    this.readControls();
    if (!this.active || this.failed) return;
    this.shown.filter((view) => view.started).forEach((view) => view.redraw());
    this.next();
  }

  showRobot() {
    const box = this.box("robot");
    if (box.checked) return;
    box.checked = true;
    this.redraw();
  }

  play() {
    if (!this.replays.length) return;
    if (this.state.time >= this.end) this.state.time = 0;
    this.showRobot();
    this.goTo(this.state.time);
    this.playing = true;
    this.player.querySelector("button").textContent = "Pause";
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const passed = Math.min(Math.max(now - last, 0), LONGEST_STEP) / 1000;
      this.goTo(this.state.time + passed * Number(this.player.querySelector("select").value));
      last = now;
      if (this.state.time >= this.end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    if (this.player) this.player.querySelector("button").textContent = "Play";
  }

  listen() {
    this.root.querySelector(".controls").addEventListener("change", ({ target }) => {
      if (target.name === `${this.key}-frame` && target.value === "robot") this.box("robot").checked = true;
      this.arrange();
      this.redraw();
    });
    this.box("layers")?.addEventListener("input", () => this.redraw());
    this.root.querySelector(".reset").addEventListener("click", () => {
      if (this.active) this.turn(firstCamera(this.shown[0].plot));
    });
    if (!this.player) return;
    this.player.querySelector("input").addEventListener("input", ({ target }) => {
      this.pause();
      const time = (Number(target.value) / Number(target.max)) * this.end;
      this.showRobot();
      this.goTo(time);
    });
    this.player.querySelector("button").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
  }
}

document.documentElement.classList.add("scripted");

// Scenes come alive near the screen; the one left longest ago gives way.
const live = [];
const scenes = new Map([...document.querySelectorAll(".scene")].map((root) => [root, new Scene(root)]));
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) continue;
    const scene = scenes.get(target), place = live.indexOf(scene);
    if (place >= 0) live.splice(place, 1);
    live.push(scene);
    scene.start();
    const open = () => live.reduce((sum, each) => sum + each.views.length, 0);
    while (live.length > 1 && open() > MOST_LIVE) live.shift().stop();
  }
}, { rootMargin: "200px" });
scenes.forEach((_, root) => watcher.observe(root));
DARK.addEventListener("change", () => scenes.forEach((scene) => { if (scene.active) scene.redraw(); }));
