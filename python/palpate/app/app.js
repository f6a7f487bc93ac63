(() => {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const finger = window.matchMedia("(pointer: coarse)").matches;
  const ENDED = "palpate has ended: start palpate app again.";
  const drawn = {};  // name of a chart -> { key, views }
  let colours, queue = Promise.resolve(), waiting = 0, slid = null;
  const element = (id) => document.getElementById(id);
  const say = (text) => { element("status").textContent = text; };

  // Requests follow each other, so that each sees the state that the one before left. `body` is called when sent.
  function send(path, body, doing = "Working ...") {
    waiting += 1;
    document.body.setAttribute("aria-busy", "true");
    say(doing);
    const asked = queue.then(() => fetch(path, { method: "POST", body: body() }).catch(() => null));
    const done = asked.then(async (answer) => {
      const content = await (answer?.ok ? answer.json() : answer?.text());
      if (!(waiting -= 1)) document.body.removeAttribute("aria-busy");
      say(answer ? "Ready" : ENDED);
      if (answer?.ok) await show(content);
      else if (answer) refuse(content);
    }).catch((error) => {
      console.error(error);
      refuse(`this is a defect of the page, please report it: ${error.message}`);
    });
    queue = done;
    return done;
  }
  const known = () => Object.values(drawn).map((each) => each.key);
  const act = (action, given = {}) => send("act", () => JSON.stringify({ action, given, known: known() }),
    ["identify", "cure", "edit"].includes(action) ? "Identifying, this takes some seconds ..." : "Working ...");

  async function show({ parts, charts, colours: found }) {
    colours = found;
    const focused = document.activeElement?.id;
    document.body.dataset.empty = String(!("reading" in parts));
    for (const part of document.querySelectorAll("[id^=part-]")) {
      const html = parts[part.id.slice(5)] ?? "";
      // A slider that is being moved keeps its place.
      if (part.dataset.html === html || part.querySelector("input[type=range]:focus")) continue;
      const open = [...part.querySelectorAll("details[open]:not([data-given])")].map((each) => each.id);
      part.innerHTML = html;
      part.dataset.html = html;
      for (const id of open) element(id)?.setAttribute("open", "");
    }
    for (const section of document.querySelectorAll("[data-needs]")) {
      section.hidden = !parts[section.dataset.needs];
    }
    element("refusal")?.focus();
    if (focused && document.activeElement === document.body) element(focused)?.focus();
    for (const figure of document.querySelectorAll("[id^=figure-]")) {
      await draw(figure, figure.id.slice(7), charts[figure.id.slice(7)] ?? { key: "" });
    }
    document.documentElement.dataset.shown = String(Number(document.documentElement.dataset.shown ?? 0) + 1);
  }

  function refuse(sentence) {
    const shown = document.createElement("p");
    shown.className = "verdict no";
    shown.tabIndex = -1;
    shown.textContent = sentence;
    element("part-message").replaceChildren(shown);
    element("part-message").dataset.html = "";
    shown.focus();
    say("Not done");
  }

  async function draw(figure, name, { key, item, html, select, frames, units }) {
    if ((drawn[name]?.key ?? "") === key) return;
    drawn[name]?.views?.clear();
    delete drawn[name];
    figure.innerHTML = html ?? "";
    if (!item) return;
    const views = await Bokeh.embed.embed_item(item);
    drawn[name] = { key, views, frames, units };
    const roots = views.roots.map((each) => each.model);
    paintCharts(colours[dark.matches ? "dark" : "light"], roots);
    // A finger scrolls the page over a chart; the fields below it do what a mouse does by dragging.
    for (const tool of finger ? roots.flatMap((root) => [...root.references()]) : []) {
      if (["BoxSelectTool", "PointDrawTool"].includes((tool.tools?.[0] ?? tool).type)) tool.active = false;
    }
    if (name === "edit") roots[0].document.on_event("panend", () => dragged(roots[0]));
    if (select) {
      roots[0].document.on_event("selectiongeometry", (_, { geometry }) => {
        if (geometry.x0 === undefined) return;
        const ends = [geometry.x0, geometry.x1].sort((a, b) => a - b);
        ["from", "to"].forEach((end, k) => { element(`${name}-${end}`).value = String(Number(ends[k].toPrecision(5))); });
        element(`correct-${name}`).open = true;
        say("Marked: now say what it is.");
      });
    }
  }
  // A handle that was dragged fills the fields of the form.
  function dragged(model) {
    const { x, y } = [...model.references()].find((each) => each.name === "handles").data_source.data;
    const fill = (name, value) => {
      const field = element(`edit-${name}`);
      if (field && Number(field.value) !== Number(value.toPrecision(4))) field.value = String(Number(value.toPrecision(4)));
    };
    fill("peak-position", x[0]); fill("peak-force", y[0]);
    fill("click-travel", x[1] - x[0]); fill("contact-force", y[1]);
    if (x.length > 2) fill("stop-position", x[2]);
    say("Now make the edited object.");
  }
  dark.addEventListener("change", () => {
    for (const { views } of Object.values(drawn)) {
      paintCharts(colours[dark.matches ? "dark" : "light"], views.roots.map((each) => each.model));
    }
  });

  // The cursor is where the handle is: of the simulated rendering that is played, or of the running device.
  let playing = false, running = false, endings = null;
  function moveTo(x, y) {
    for (const { model } of drawn.feel?.views.roots ?? []) {
      for (const each of model.references()) {
        if (each.name === "cursor") each.data_source.data = { x: [x], y: [y] };
      }
    }
    const [ofX, ofY] = (drawn.feel?.units ?? ["", ""]).map((each) => each.replace("*", "·"));
    element("readout").textContent = `position ${x.toPrecision(3)} ${ofX}, force ${y.toPrecision(3)} ${ofY}`;
  }
  function showMoment(share) {
    const [time, x, y] = drawn.feel.frames, k = Math.round(share * (time.length - 1));
    moveTo(x[k], y[k]);
  }
  function play() {
    const begin = performance.now() - 1000 * element("moment").value * drawn.feel.frames[0].at(-1);
    const step = (now) => {
      const slider = element("moment"), times = drawn.feel?.frames?.[0];
      if (!playing || !slider || !times) { playing = false; return; }
      slider.value = Math.min(1, (now - begin) / 1000 / times.at(-1));
      showMoment(slider.value);
      if (slider.value < 1) requestAnimationFrame(step);
      else { playing = false; element("play").textContent = "Play"; slider.value = 0; }
    };
    requestAnimationFrame(step);
  }
  async function pulse() {
    try {
      const { progress, running: now, ended: how, endings: count, at } = await (await fetch("pulse")).json();
      element("stop-identification").hidden = !progress;
      if (progress) say(progress);
      if (now && at) { moveTo(...at); say("The device is running"); }
      if (count !== (endings ?? count)) { say(`The device has stopped: ${how}`); act("refresh"); }
      [running, endings] = [now, count];
    } catch (error) {
      say(ENDED);
    }
    setTimeout(pulse, running ? 100 : 1000);
  }

  const fieldsOf = (form) => (form ? Object.fromEntries(new FormData(form)) : {});
  document.addEventListener("click", async (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (button.dataset.action) {
      const form = button.closest("form");
      await act(button.dataset.action, { ...fieldsOf(form), ...JSON.parse(button.dataset.given ?? "{}") });
      if (!element("refusal")) form?.reset();
    } else if ("play" in button.dataset) {
      playing = !playing;
      button.textContent = playing ? "Pause" : "Play";
      if (playing) play();
    } else if ("start" in button.dataset) {
      playing = false;
      send(`start?device=${encodeURIComponent(element("connection").value)}`, () => "", "Starting the device ...");
    } else if ("stop" in button.dataset) {  // does not wait for other requests
      const { refused } = await (await fetch("stop", { method: "POST" })).json();
      if (refused) refuse(refused);
    } else if ("stopIdentification" in button.dataset) {
      await fetch("stop-identification", { method: "POST" });
    } else if (button.dataset.copy) {
      await navigator.clipboard.writeText(element(button.dataset.copy).textContent.trim());
      say("Copied");
    } else if (button.dataset.download) {
      await queue;
      say("Writing ...");
      const answer = await fetch(`file/${button.dataset.download}`);
      if (!answer.ok) { refuse(await answer.text()); return; }
      const link = document.createElement("a");
      link.href = URL.createObjectURL(await answer.blob());
      link.download = decodeURIComponent(answer.headers.get("X-Name"));
      link.click();
      say(`${link.download} is in your downloads`);
    }
  });
  document.addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("change", (event) => {
    const target = event.target, form = target.closest("form[data-action]");
    if (target.id === "file") add(target.files);
    else if (target.dataset.action) act(target.dataset.action, { [target.name]: target.value });
    else if (form) act(form.dataset.action, fieldsOf(form));
  });
  document.addEventListener("input", ({ target }) => {
    if (target.id === "moment") { playing = false; showMoment(target.value); }
    if (target.type !== "range" || !target.dataset.field) return;
    const value = target.dataset.base * target.dataset.factor ** target.value;
    const text = `${Number(value.toPrecision(4))} ${target.dataset.unit}`;
    document.querySelector(`output[for="${target.id}"]`).textContent = text;
    target.setAttribute("aria-valuetext", text);
    const first = slid === null;  // while one answer is awaited, only the newest place is kept
    slid = { field: target.dataset.field, value };
    if (first) queue.then(() => { const given = slid; slid = null; act("change-device", given); });
  });
  document.addEventListener("keydown", (event) => {
    const typing = event.target.matches("input[size], textarea");
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && !typing) { event.preventDefault(); act("undo"); }
  });

  function add(files) {
    for (const file of files) send(`add?name=${encodeURIComponent(file.name)}`, () => file, `Reading ${file.name} ...`);
    element("file").value = "";
  }
  for (const kind of ["dragenter", "dragover", "dragleave", "drop"]) {
    document.addEventListener(kind, (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      document.body.classList.toggle("dragging", kind === "dragenter" || kind === "dragover");
      if (kind === "drop") add(event.dataTransfer.files);
    });
  }
  Bokeh.set_log_level("warn");
  pulse();
  act("refresh");
})();
