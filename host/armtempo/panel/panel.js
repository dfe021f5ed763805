// What the page does by itself: it moves the arm smoothly between the server's messages, says every 0.1 s that a
// button is still held, takes the keys for stop, and covers itself when the server falls silent.
window.armtempo = {
  parts: null,
  from: null,
  to: null,
  ghost: null, // where the plan is played
  target: null, // where the arm goes
  changes: 0,
  since: 0,
  heard: performance.now(),
  is_first: true, // nothing was heard yet
  offsets_ms: [], // of this page's clock to the server's, by the last messages of this connection
  OFFSETS: 50,
  state: 0, // the number of the state that is shown
  number: 0, // of the presses
  answered: null, // the number of the last press that the server has seen, and why it was refused
  held: null, // the number of the press of the button that is held
  lines: {}, // three.js objects by name
  dials: [], // ranges of the joints
  tool: null, // its frame and shape
  vias: [], // where the names of the via points are
  names: [], // three.js objects: the names
  named: [], // the arm's frames
  framed: [undefined, undefined], // what was drawn of them
  shaded: "", // for which page the ghost has its colour
  frames: null, // three.js objects: of the base, the tool and the named ones
  frames_shown: true,
  follow: false,
  THREE: null,
  SMOOTH_MS: 100,
  LOOK_MS: 100,
  FIRST_MS: 10000, // in which a slow tablet has built the page
  SILENT_MS: 850, // with LOOK_MS and a busy browser within a second

  // the scene is there, some time after the page
  show(parts) {
    this.parts = parts;
    import("nicegui-scene").then((module) => ([this.THREE, this.Label] = [module.THREE, module.CSS2DObject]));
    setInterval(() => this.draw(), 50); // as often as the scene is drawn: at each frame it would cost twice as much
  },

  // the page is there, with what the server knew when it was asked for; nothing can be pressed until it is heard
  wait(texts) {
    document.body.dataset.lost = texts.lost;
    document.body.inert = true;
    setInterval(() => this.look(), this.LOOK_MS);
  },

  begin() {
    const send = socket.emit.bind(socket);
    // Nothing is kept: socket.io would send it after a reconnection, when nobody means it any more
    socket.emit = (name, ...rest) => (name !== "event" || socket.connected ? send(name, ...rest) : socket);
    socket.on("disconnect", () => this.unconnected());
    addEventListener("keydown", (event) => this.key(event), true); // before a button takes the space bar for itself
    addEventListener("keyup", (event) => event.key === "Enter" && this.release(), true);
    addEventListener("pointerdown", (event) => event.button === 0 && this.press(event), true);
    addEventListener("contextmenu", (event) => event.target.closest("[data-hold]") && event.preventDefault());
    addEventListener("pointermove", (event) => event.buttons && (this.changes += 1)); // perhaps a via point is dragged
    for (const gone of ["pointerup", "pointercancel", "blur"]) addEventListener(gone, () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  },

  // a message of the server, about ten a second
  hear(message) {
    this.heard = performance.now();
    this.is_first = false;
    if (!socket.connected) return;
    this.state = message.state;
    this.offsets_ms = [...this.offsets_ms.slice(1 - this.OFFSETS), this.heard - 1000 * message.clock_s];
    document.body.classList.remove("lost"); // which covers the page
    document.body.inert = false;
    this.target = message.ghost;
    document.body.classList.toggle("unknown", message.unknown); // the arm is then drawn as its ghost
    document.body.classList.toggle("old", message.old); // nobody knows where it is now
    document.body.classList.toggle("freezes", message.freeze);
    if (JSON.stringify(message.tool) !== JSON.stringify(this.tool)) this.tool = message.tool;
    if (JSON.stringify(message.dials) !== JSON.stringify(this.angles)) this.angles = message.dials;
    if (JSON.stringify(message.links) !== JSON.stringify(this.to)) {
      this.from = this.now();
      this.to = message.links;
    }
    this.since = performance.now();
    for (const [id, text] of Object.entries(message.texts || {})) {
      const element = document.getElementById(id);
      if (element && element.textContent !== text) element.textContent = text;
    }
  },

  now() {
    if (!this.to) return null;
    if (!this.from) return this.to;
    const part = (performance.now() - this.since) / this.SMOOTH_MS;
    if (part >= 1) return this.to;
    return this.to.map((pose, i) => pose.map((value, k) => {
      const before = this.from[i];
      const sign = k > 2 && [3, 4, 5, 6].reduce((sum, n) => sum + before[n] * pose[n], 0) < 0 ? -1 : 1;
      return before[k] * sign + (value - before[k] * sign) * part;
    }));
  },

  draw() {
    const scene = this.parts && getElement(this.parts.scene);
    if (scene && scene.objects) {
      this.begin_scene(scene);
      this.shade(scene);
      this.place(scene, this.parts.links, this.now());
      this.place(scene, this.parts.ghost, this.ghost || this.target);
      this.turn(scene);
      this.axes(scene);
    }
  },

  // the ghost: dark on a light page, light on a dark one
  shade(scene) {
    const dark = Number(matchMedia("(prefers-color-scheme: dark)").matches);
    if (`${dark} ${scene.objects.size}` === this.shaded) return;
    this.shaded = `${dark} ${scene.objects.size}`;
    this.changes += 1;
    for (const id of this.parts.ghost)
      scene.objects.get(id)?.mesh?.traverse((one) => one.material?.color.set(this.parts.colours.ghost[dark]));
  },

  // x, y and z of the base, of the tool and of the arm's frames: red, green, blue; names; and the tool
  axes(scene) {
    if (!this.THREE || (this.tool === this.framed[0] && this.named === this.framed[1])) return;
    const T = this.THREE;
    this.changes += 1;
    if (!this.frames) {
      this.frames = { base: this.frame(0.2), tool: this.frame(0.12), named: new T.Group(), body: this.body() };
      for (const one of Object.values(this.frames)) scene.scene.add(one);
      this.show_frames(this.frames_shown);
    }
    if (this.named !== this.framed[1]) {
      const group = this.frames.named;
      for (const one of [...group.children]) this.remove(group, one);
      for (const [name, columns] of this.named) group.add(this.put(this.frame(0.1, name), columns));
    }
    if (this.tool && this.tool.name !== this.framed[0]?.name) {
      this.remove(scene.scene, this.frames.tool);
      scene.scene.add((this.frames.tool = this.frame(0.12, this.tool.name)));
    }
    this.framed = [this.tool, this.named];
    this.show_frames(this.frames_shown);
    this.frames.body.visible = false;
    if (!this.tool) return;
    this.put(this.frames.tool, this.tool.frame);
    const [begin, end] = [this.tool.from, this.tool.frame.slice(9)].map((place) => new T.Vector3(...place));
    const body = this.frames.body, along = end.clone().sub(begin), length = along.length();
    body.visible = length > 1e-4;
    body.scale.set(this.tool.radius, length, this.tool.radius);
    body.position.copy(begin).addScaledVector(along, 0.5);
    if (length) body.quaternion.setFromUnitVectors(new T.Vector3(0, 1, 0), along.normalize());
  },

  body() {
    return new this.THREE.Mesh(new this.THREE.CylinderGeometry(1, 1, 1, 20), new this.THREE.MeshPhongMaterial({ color: this.parts.colours.tool }));
  },

  frame(length, name) {
    const found = new this.THREE.AxesHelper(length).setColors(...this.parts.colours.axes.map((one) => new this.THREE.Color(one)));
    found.matrixAutoUpdate = false;
    if (name) {
      const text = document.createElement("div");
      text.textContent = name;
      text.className = "armtempo-label";
      found.add(new this.Label(text));
    }
    return found;
  },

  put(frame, columns) {
    const vectors = [0, 3, 6, 9].map((at) => new this.THREE.Vector3(...columns.slice(at, at + 3)));
    frame.matrix.makeBasis(...vectors.slice(0, 3)).setPosition(vectors[3]);
    return frame;
  },

  remove(parent, frame) {
    frame.traverse((one) => one.element?.remove()); // which three.js leaves in the page
    parent.remove(frame);
  },

  show_frames(shown) {
    this.frames_shown = shown;
    this.changes += 1;
    if (!this.frames) return;
    this.frames.base.visible = this.frames.named.visible = shown;
    this.frames.tool.visible = shown && Boolean(this.tool);
  },

  // The scene draws 20 times a second; what has not changed is drawn once a second, which spares a tablet's battery.
  begin_scene(scene) {
    if (scene.renderer === this.renderer || !scene.renderer) return;
    const renderer = (this.renderer = scene.renderer);
    const render = renderer.render.bind(renderer);
    let shown = "", drawn = 0;
    renderer.setClearColor(0x000000, 0); // as the page, light or dark
    const ground = scene.scene.children.find((child) => child.object_id === "ground");
    if (ground) scene.scene.remove(ground);
    renderer.render = (what, camera) => {
      const tool = this.follow && this.now()?.at(-1);
      if (tool) scene.controls.target.set(...tool.slice(0, 3));
      const size = renderer.domElement.width + "x" + renderer.domElement.height;
      const state = [size, scene.objects.size, this.changes, ...camera.matrix.elements].join();
      if (state === shown && performance.now() - drawn < 1000) return;
      [shown, drawn] = [state, performance.now()];
      this.name_vias(scene, camera);
      render(what, camera);
    };
  },

  // the numbers of via points: as one where they would cover each other
  name_vias(scene, camera) {
    if (!this.THREE || !(this.vias.length || this.names.length)) return;
    const canvas = scene.renderer.domElement;
    const places = this.vias.map((via) => {
      const { x, y } = new this.THREE.Vector3(...via).project(camera);
      return [(x * canvas.clientWidth) / 2, (y * canvas.clientHeight) / 2];
    });
    const found = this.merged(places);
    while (this.names.length > found.length) this.remove(scene.scene, this.names.pop());
    found.forEach(({ text, first }, i) => {
      if (!this.names[i]) {
        const element = Object.assign(document.createElement("div"), { className: "armtempo-via" });
        scene.scene.add((this.names[i] = new this.Label(element)));
      }
      this.names[i].position.set(...this.vias[first]);
      if (this.names[i].element.textContent !== text) this.names[i].element.textContent = text;
    });
  },

  // texts for numbers at places in pixels, none over another: "P0", "P3–5, 8" at the first of them
  merged(places) {
    const WIDTH = 7, HEIGHT = 14; // of a letter, pixels
    const text = (numbers) => {
      const runs = [];
      for (const one of numbers) one === runs.at(-1)?.[1] + 1 ? (runs.at(-1)[1] = one) : runs.push([one, one]);
      return "P" + runs.map(([low, high]) => (low === high ? low : `${low}–${high}`)).join(", ");
    };
    const made = (numbers) => ({ numbers, text: text(numbers), first: numbers[0] });
    const covers = (one, other) => {
      const [dx, dy] = [0, 1].map((axis) => Math.abs(places[one.first][axis] - places[other.first][axis]));
      return dy < HEIGHT && dx < ((one.text.length + other.text.length) * WIDTH) / 2;
    };
    const found = [];
    for (let left = places.map((_, number) => made([number])); left.length; ) {
      const one = left.shift(), at = found.findIndex((other) => covers(one, other));
      if (at < 0) found.push(one);
      else left.unshift(made([...found.splice(at, 1)[0].numbers, ...one.numbers].sort((a, b) => a - b)));
    }
    return found.sort((one, other) => one.first - other.first);
  },

  place(scene, ids, poses) {
    ids.forEach((id, i) => {
      const found = scene.objects.get(id);
      if (!found || !found.mesh) return;
      found.mesh.visible = Boolean(poses);
      if (!poses || poses[i] === found.placed) return;
      found.placed = poses[i];
      this.changes += 1;
      found.mesh.position.set(...poses[i].slice(0, 3));
      found.mesh.quaternion.set(...poses[i].slice(3)).normalize();
    });
  },

  // a line through points, of a colour or with one for each point, in the place of the one of that name; tried again until three.js is loaded
  line(name, points, colour) {
    const scene = this.parts && getElement(this.parts.scene);
    if (!this.THREE || !scene || !scene.scene) return setTimeout(() => this.line(name, points, colour), 100);
    if (this.lines[name]) scene.scene.remove(this.lines[name]);
    delete this.lines[name];
    this.changes += 1;
    if (points.length > 1) scene.scene.add((this.lines[name] = this.polyline(points, colour)));
  },

  polyline(points, colour) {
    const T = this.THREE;
    const shape = new T.BufferGeometry().setFromPoints(points.map((point) => new T.Vector3(...point)));
    if (!Array.isArray(colour)) return new T.Line(shape, new T.LineBasicMaterial({ color: colour }));
    const linear = points.map((_, i) => new T.Color().setRGB(...colour.slice(3 * i, 3 * i + 3), T.SRGBColorSpace).toArray());
    shape.setAttribute("color", new T.Float32BufferAttribute(linear.flat(), 3));
    return new T.Line(shape, new T.LineBasicMaterial({ vertexColors: true }));
  },

  // an arc at each joint for its range, and a hand on it for its angle
  turn(scene) {
    if (!this.THREE || !this.angles || this.angles === this.turned) return;
    this.turned = this.angles;
    this.changes += 1;
    const T = this.THREE, RADIUS = 0.11;
    const vector = (numbers) => new T.Vector3(...numbers);
    this.angles.forEach((dial, i) => {
      if (!this.dials[i]) {
        const [low, high] = this.parts.ranges[i];
        const arc = Array.from({ length: 49 }, (_, k) => low + ((high - low) * k) / 48);
        const on = (angle) => [RADIUS * Math.cos(angle), RADIUS * Math.sin(angle), 0];
        const group = new T.Group();
        group.add(this.polyline([[0, 0, 0], ...arc.map(on), [0, 0, 0]], this.parts.colours.dial));
        group.add(this.polyline([[0, 0, 0], [1.25 * RADIUS, 0, 0]], this.parts.colours.dial));
        group.visible = low < high; // a sliding joint has no dial
        scene.scene.add((this.dials[i] = group));
      }
      if (!this.dials[i].visible) return;
      const zero = vector(dial.slice(3, 6)), axis = vector(dial.slice(6, 9));
      const basis = new T.Matrix4().makeBasis(zero, axis.clone().cross(zero), axis);
      this.dials[i].quaternion.setFromRotationMatrix(basis);
      this.dials[i].position.set(...dial.slice(0, 3));
      this.dials[i].children[1].rotation.z = dial[9];
    });
  },

  // The space bar stops from everywhere but where it writes a space; Enter holds a jog button as a finger does. A page
  // that is covered takes no key but those that stop: its server may still hear them.
  key(event) {
    const lost = document.body.matches(".lost");
    const typing = !lost && event.target.matches("textarea, input[type=text]:not([readonly])");
    if (event.key === "Escape" || (event.key === " " && !typing)) {
      event.preventDefault();
      if (event.key === " ") event.stopPropagation();
      else document.querySelector(".q-dialog .armtempo-cancel")?.click(); // a question is answered with no
      if (!event.repeat) emitEvent("armtempo-stop");
    } else if (event.key === "Enter" && lost) {
      event.preventDefault();
      event.stopPropagation();
    } else if (event.key === "Enter" && !event.repeat) this.press(event);
  },

  // what the server needs to know of a press: see press.py
  stamp(number, at = performance.now()) {
    return { number, state: this.state, made_s: (at - Math.min(...this.offsets_ms)) / 1000 };
  },

  // a command: a press, or another event with its value
  command(event, emit) {
    if (!this.offsets_ms.length || !socket.connected) return this.unconnected();
    const at = (event instanceof Event ? event : window.event)?.timeStamp;
    emit(this.stamp(++this.number, at), event instanceof Event ? null : event);
  },

  unconnected() {
    this.held = null;
    this.offsets_ms = [];
    document.body.classList.add("lost");
  },

  press(event) {
    const button = event.target.closest("[data-hold]:not([disabled])");
    if (!button || this.held !== null) return;
    event.preventDefault();
    if (!this.offsets_ms.length) return;
    this.held = ++this.number;
    emitEvent("armtempo-press", { ...this.stamp(this.held, event.timeStamp), hold: Number(button.dataset.hold) });
  },

  release() {
    if (this.held === null) return;
    const number = this.held;
    this.held = null;
    emitEvent("armtempo-release", number);
  },

  look() {
    if (this.held !== null) emitEvent("armtempo-held", this.stamp(this.held));
    if (performance.now() - this.heard > (this.is_first ? this.FIRST_MS : this.SILENT_MS)) {
      this.held = null;
      document.body.classList.add("lost");
    }
  },
};
{ // what the picture is drawn with, 0.8 MB, comes while the page is built
  const { imports } = JSON.parse(document.querySelector("script[type=importmap]").textContent);
  document.head.append(Object.assign(document.createElement("link"), { rel: "modulepreload", href: imports["nicegui-scene"] }));
}
