"""Bad inputs to what stands around the core: data sets, files of others, pictures, classes of one's
own, sweeps, the explorer, folders of reinforcement learning and the rest of the command lines.
"""

from __future__ import annotations

from tests.campaign.case import REAL, SEED, TEXT, WHOLE, Case, fine, of


def cases() -> list[Case]:
    """All of them, in a fixed order."""
    return [
        *_data_sets(), *_recordings(), *_pictures(), *_own_classes(), *_sweeps(), *_explorer(),
        *_rl(), *_commands(),
    ]  # fmt: skip


def _after(owner: str, head: str, template: str, values: tuple[str, ...] | list[str]) -> list[Case]:
    """`template` once for each value after some lines that the name of the case leaves out."""
    return [Case(case.name, owner, f"{head}\n{case.code}") for case in of(owner, template, values)]


def _data_sets() -> list[Case]:
    owner = "gnm_env/trials.py"
    two = "Trials([trial, trial], columns={'voice': ['a', 'b']})"
    made = of(owner, f"{two}.split(«», 0)", [*REAL, "0.0", "1.0", "2.0"])
    made += of(owner, f"{two}.split(0.5, «»)", [*SEED, "None"])
    made += of(owner, f"{two}.split(0.5, 0, by=«»)", ["3", "'bogus'", "['voice']", "object()"])
    made += of(owner, f"{two}.shuffled(«»)", [*SEED, "None"])
    made += of(
        owner, "Trials.concatenate(«»)",
        ["None", "[]", "3", "[trial]", "[None]", "'x'", "Trials([trial])", "object()",
         "[Trials([trial]), Trials([Trial.from_dense(np.zeros((3, 5)), label=1)])]"],
    )  # fmt: skip
    good = (
        "n_inputs=3, n_bins=[4, 2], spikes=[3, 1], channels=[0, 2, 1, 1], bins=[0, 0, 3, 1], "
        "presentations=[2, 0], onsets=[0, 3], ends=[2, 4], targets=[1, 2], classes=[0, 1]"
    )
    wrong = [
        "None",
        "'x'",
        "[-1]",
        "[nan]",
        "[2**62, 1]",
        "[[1], [2, 3]]",
        "object()",
        "[9] * 9",
        "{}",
    ]
    for name in (
        "n_bins",
        "spikes",
        "channels",
        "bins",
        "presentations",
        "onsets",
        "ends",
        "targets",
        "classes",
    ):
        for value in wrong:
            made.append(
                Case(
                    f"Trials.from_arrays({name}={value})",
                    owner,
                    f"made = Trials.from_arrays(**{{**dict({good}), {name!r}: {value}}})\n"
                    "[one.dense() for one in made]",
                )
            )
    made += of(
        owner, f"Trials.from_arrays(**{{**dict({good}), 'n_inputs': «»}})", [*WHOLE, "0", "2"]
    )
    made += of(
        owner,
        "Trials([trial]).arrays.edges.setflags(write=True)\nTrials([trial]).n_bins = «»",
        ["3"],
    )
    # A seed may be a Generator's; a fraction may leave a part empty only by being refused.
    return fine(made, "seed=True", "'presentations': None", "'classes': None")


def _recordings() -> list[Case]:
    made: list[Case] = []
    owner = "gnm_env/recordings/csv.py"
    head = "from gnm_env.recordings import from_csv, from_events, from_hdf5"
    rows = "trial,channel,time,label\\n0,0,0.0131,2\\n0,4,0.0150,2\\n1,0,0.0007,0\\n"
    call = "from_csv('f', bin_width=0.001, label='label')"
    texts = [
        "''", "'trial,channel,time,label'", "'a,b\\n1,2\\n'", "'trial,channel,time,label\\n0,0,x,2\\n'",
        "'trial,channel,time,label\\n0,-1,0.1,2\\n'", "'trial,channel,time,label\\n0,0,nan,2\\n'",
        "'trial,channel,time,label\\n0,0,-1,2\\n'", "'trial,channel,time,label\\n0,0,1e300,2\\n'",
        "'trial,channel,time,label\\n0,0,0.1\\n'", "'trial,channel,time,label\\n0,0,0.1,2,3\\n'",
        "'trial,channel,time,label\\n0,0,0.1,x\\n'", "'trial,channel,time,label\\n0,0,0.1,-2\\n'",
        "'trial,channel,time,label\\n0,0,0.1,1\\n0,0,0.2,2\\n'", "'trial,channel,time,label\\n0,99999999999,0.1,1\\n'",
        "'channel,time\\n0,0.1\\n'", "'trial,channel,time,label\\n0,0,0.1,1e400\\n'", "'\\0' * 99",
    ]  # fmt: skip
    made += _after(owner, head, f"Path('f').write_text(«»)\n{call}", texts)
    made += _after(
        owner,
        head,
        f"Path('f').write_bytes(«»)\n{call}",
        ["bytes(range(256))", "'ä'.encode('latin-1')"],
    )
    good = f"Path('f').write_text('{rows}')\n"
    made += _after(
        owner, head, good + "from_csv(«», bin_width=0.001, label='label')",
        ["None", "3", "'missing'", "'.'", "'a\\0b'", "'x' * 300", "object()", "''"],
    )  # fmt: skip
    made += _after(
        owner,
        head,
        good + "from_csv('f', bin_width=«», label='label')",
        [*REAL, "0.0", "1e-300", "inf"],
    )
    made += _after(
        owner, head, good + "from_csv('f', bin_width=0.001, label=«»)",
        ["None", "3", "'bogus'", "[1]", "[1, 2, 3]", "[0.5, 1]", "['a', 'b']", "[-1, 0]", "{}",
         "lambda name: 'x'", "lambda name: None", "lambda name: -1", "lambda name: 1 / 0", "[2**62, 1]"],
    )  # fmt: skip
    made += _after(
        owner, head, good + "from_csv('f', bin_width=0.001, label='label', n_inputs=«»)",
        [*(v for v in WHOLE if v != "None"), "2", "2**62"],
    )  # fmt: skip
    made += _after(
        owner, head, good + "from_csv('f', bin_width=0.001, label='label', duration=«»)",
        [*(v for v in REAL if v != "None"), "0.0", "inf", "1e300", "0.001"],
    )  # fmt: skip
    made += _after(
        owner, head, good + "from_csv('f', bin_width=0.001, label='label', delimiter=«»)",
        ["''", "'ab'", "None", "3", "';'", "object()"],
    )  # fmt: skip

    owner = "gnm_env/recordings/events.py"
    head += "\nevents = np.array([(0, 1, 1, 0), (900, 0, 1, 1)], [('t', 'i8'), ('x', 'i8'), ('y', 'i8'), ('p', 'i8')])"
    call = "from_events([events], bin_width=100, label=[1], sensor_size=(2, 2, 2))"
    made += _after(
        owner, head, call.replace("[events]", "«»"),
        ["None", "3", "'x'", "[]", "[None]", "[3]", "['x']", "[np.zeros(3)]", "events", "[[1, 2]]", "{}", "object()",
         "[events[['x', 'y']]]", "[events[:0]]", "[np.zeros(2, [('t', 'f8'), ('x', 'f8')])]",
         "[np.zeros(2, [('t', 'U3'), ('x', 'i8')])]", "[np.full(2, 9, [('t', 'i8'), ('x', 'i8')])]"],
    )  # fmt: skip
    made += _after(owner, head, call.replace("=100", "=«»"), [*REAL, "0", "1e-300", "inf"])
    made += _after(
        owner, head, call.replace("[1]", "«»"),
        ["None", "3", "'x'", "[]", "[1, 2]", "[0.5]", "[-1]", "['a']", "lambda e: 'x'", "lambda e: len(e) / 0"],
    )  # fmt: skip
    made += _after(
        owner, head, call.replace("(2, 2, 2)", "«»"),
        ["None", "3", "'abc'", "(2, 2)", "(0, 2, 2)", "(2, 2, -1)", "(1, 1, 1)", "(2.5, 2, 2)", "(2**40, 2**40, 2)", "{}"],
    )  # fmt: skip
    made += _after(
        owner, head, call.replace(")", ", duration=«»)").replace("(2, 2, 2, duration=«»)", "(2, 2, 2)"),
        [v for v in (*REAL, "0", "inf", "1e300") if v != "None"],
    )  # fmt: skip

    owner = "gnm_env/recordings/hdf5.py"
    call = "from_hdf5('f', bin_width=0.005)"
    made += _after(
        owner,
        head,
        f"Path('f').write_bytes(«»)\n{call}",
        ["b''", "b'text'", "b'\\x89HDF\\r\\n\\x1a\\n'", "bytes(99)"],
    )
    made += _after(
        owner,
        head,
        "from_hdf5(«», bin_width=0.005)",
        ["None", "3", "'missing'", "'.'", "'a\\0b'", "object()", "''"],
    )
    write = (
        "import h5py\n"
        "with h5py.File('f', 'w') as f:\n"
        "    kind = h5py.vlen_dtype(np.dtype('f8'))\n"
        "    times = f.create_dataset('spikes/times', (2,), kind)\n"
        "    units = f.create_dataset('spikes/units', (2,), kind)\n"
        "    times[0], times[1], units[0], units[1] = [0.1, 0.2], [0.3], [1, 2], [0]\n"
        "    f['labels'] = [1, 0]\n"
        "    «»\n"
    )
    for change in (
        "del f['spikes/times']", "del f['spikes/units']", "del f['labels']", "f['labels'][0] = -1",
        "del f['labels']; f['labels'] = [1, 2, 3]", "del f['labels']; f['labels'] = ['a', 'b']",
        "del f['labels']; f.create_group('labels')", "del f['spikes']; f['spikes'] = 3",
        "f['spikes/times'][0] = np.array([np.nan, 1.0])", "f['spikes/times'][0] = np.array([1.0])",
        "f['spikes/units'][0] = np.array([-1.0, 1.0])", "f['spikes/units'][0] = np.array([1e15, 1.0])",
        "f['spikes/times'][0] = np.array([-1.0, 1.0])", "f['spikes/times'][0] = np.array([1e12, 1.0])",
        "del f['spikes/times']; f['spikes/times'] = 3.5", "del f['spikes/units']; f['spikes/units'] = ['a', 'b']",
    ):  # fmt: skip
        made.append(Case(f"hdf5: {change}", owner, f"{head}\n{write.replace('«»', change)}{call}"))
    made += _after(
        owner, f"{head}\n{write.replace('«»', '')}", "from_hdf5('f', bin_width=0.005, label=«»)",
        ["None", "3", "'bogus'", "[1]", "[0.5, 1]", "lambda word: 'x'", "lambda word: -1", "{}"],
    )  # fmt: skip
    made += _after(
        owner, f"{head}\n{write.replace('«»', '')}", "from_hdf5('f', bin_width=0.005, n_inputs=«»)",
        [*(v for v in WHOLE if v != "None"), "2"],
    )  # fmt: skip
    return fine(
        made,
        "channel,time\\n0,0.1\\n'",
        "label=lambda name: None",
        "duration=0.001",
        "bin_width=inf",
        "delimiter=';'",
        "events[:0]",  # silence is a recording, too
    )


def _pictures() -> list[Case]:
    made: list[Case] = []
    owner = "agents/plotting.py"
    call = "plot(agent(), task, patterns)"
    made += of(owner, call.replace("agent()", "«»"), ["None", "3", "'x'", "[]", "GNM()", "[agent()]", "object()",
               "NeuronAgent(GNM(), ErrorTrace(), 5)"])  # fmt: skip
    made += of(owner, call.replace("task, patterns", "«»"), ["None", "None, patterns", "task", "task, None", "3, 3", "task, 3",
               "Task(), patterns", "Trials([Trial.from_dense(np.zeros((3, 5)), label=1)])", "trial", "[trial]",
               "Trials([trial]), patterns", "task, patterns, 3", "task, patterns, 'x'", "task, patterns, []",
               "task, patterns, train_many([agent(), agent()], task, patterns, trials=2, seed=1)"])  # fmt: skip
    owner = "agents/watching.py"
    call = "play(agent(), task, patterns, 'f.gif', bins=4)"
    made += of(owner, call.replace("agent()", "«»"), ["None", "3", "'x'", "GNM()", "object()", "continuous()",
               "NeuronAgent(GNM(), ErrorTrace(), 5)", "type('P', (), {'predict': lambda *a, **k: 3})()",
               "type('P', (), {'predict': lambda *a, **k: ('x', None)})()"])  # fmt: skip
    made += of(
        owner,
        call.replace("task, patterns", "«»"),
        ["None, patterns", "task, None", "Task(), patterns", "3, 3"],
    )
    made += of(owner, call.replace("'f.gif'", "«»"), ["3", "'f.txt'", "''", "'no/f.gif'", "'.'", "'a\\0.gif'",
               "'x' * 300 + '.gif'", "object()", "'/proc/x.gif'", "[]"])  # fmt: skip
    made += of(owner, call.replace("bins=4", "bins=«»"), [*WHOLE, "0"])
    for name in ("seed", "every"):
        made += of(
            owner,
            call.replace("bins=4", f"bins=4, {name}=«»"),
            [v for v in (*(SEED if name == "seed" else WHOLE), "0") if (name, v) != ("seed", "0")],
        )
    for name in ("fps", "scale"):
        made += of(
            owner, call.replace("bins=4", f"bins=4, {name}=«»"), [*REAL, "0", "1e-300", "1e300"]
        )
    made += of(owner, call.replace("bins=4", "bins=4, hears=«»"), TEXT)
    return fine(
        made, "seed=True", "seed=[1, 2]", "scale=1e-300", "every=10**30", "task, patterns, []"
    )


def _own_classes() -> list[Case]:
    made: list[Case] = []
    owner = "agents/registry.py"
    for kind in ("neuron", "model", "rule"):
        head = f"from agents.registry import find_{kind}"
        made += _after(owner, head, f"find_{kind}(«»)", [
            "None", "3", "'bogus'", "''", "':'", "'a:'", "':B'", "'json:loads'", "'json:JSONDecoder'", "'nothing.here:A'",
            "'missing.py:A'", "'a b:C'", "'agents:GNM:LIF'", "'..:A'", "'.x:A'", "'/etc/hostname:A'", "object()", "b'gnm'",
        ])  # fmt: skip
        text = "Path('mine.py').write_text(«»)\n" + f"find_{kind}('mine.py:Mine')"
        made += _after(owner, head, text, [
            "''", "'class Mine: pass'", "'Mine = 3'", "'def Mine(): pass'", "'class Mine('", "'raise ValueError(1)'",
            "'import nothing_of_that_name'", "'\\0'", "'1 / 0'",
        ])  # fmt: skip
    owner = "agents/check.py"
    made += of(
        owner,
        "check_neuron(«»)",
        ["None", "3", "'gnm'", "GNM", "[]", "AggregateLabel()", "object()", "agent()"],
    )
    made += of(
        owner,
        "check_rule(«»)",
        ["None", "3", "'all'", "AggregateLabel", "GNM()", "agent()", "object()"],
    )
    made += of(
        owner,
        "check_rule(AggregateLabel(fraction=0.25), «»)",
        ["3", "'gnm'", "GNM", "agent()", "object()"],
    )
    made += of(owner, "pretrained(«»)", ["None", "3", "'bogus'", "'../x'", "''", "object()", "[]"])
    # What a file of one's own raises while it is imported is that file's.
    return fine(
        made,
        "raise ValueError(1)",
        "nothing_of_that_name",
        "1 / 0",
        "class Mine('",
        "write_text('\\\\0')",
    )


def _sweeps() -> list[Case]:
    owner = "agents/experiments"
    head = (
        "from agents.experiments import Axis, class_counts, pattern_seeds, training\n"
        "def mine(*axes, **common):\n"
        "    axes = (class_counts(1), pattern_seeds((0, 1)), *axes)\n"
        "    return training('mine', 'My own', axes, **{'trials': 5, 'runs': 2, 'cap': 9, **common})"
    )
    made = _after(owner, head, "mine(Axis(«»))", [
        "'rate', ()", "'rate', (0.1, 0.1)", "'rate', (7.0,)", "'rate', ('x',)", "'rate', (nan,)", "'bogus', (1,)",
        "'alpha', (7.0,)", "'alpha', (None,)", "'rate', 3", "'rate', None", "3, (1,)", "'rate', (0.1,), -1",
        "'rate', (0.1,), 'x'", "'rate', (0.1, 0.2), 1, ({'rate': 0.1},)", "'rate', (0.1,), 1, (3,)",
        "'rate', (0.1,), 0.5", "'neuron', ('bogus',)", "'rule', ('bogus',)", "'classes', (1,)", "'x', (1,), 1, ({'bogus': 2},)",
        "'trials', (0,)", "'runs', (1, 2)", "'rate', ([0.1],)", "'rate', (object(),)",
    ])  # fmt: skip
    made += _after(owner, head, "mine(«»)", [
        "3", "None", "'x'", "trials=0", "trials='x'", "runs=0", "cap=-1", "cap=nan", "neuron='bogus'", "rule=3", "bogus=1",
        "start='bogus'", "initial_weight='x'", "weight_bounds=3", "weight_bounds=(1, 0)", "keep_weights='no'", "n_inputs=-1",
        "rate=7", "targets=()", "targets='x'", "trials=2.5", "neuron=None", "learning_rate=nan", "alpha='x'",
    ])  # fmt: skip
    made += _after(owner, head, "class_counts(«»)", WHOLE)
    made += _after(
        owner,
        head,
        "pattern_seeds(«»)",
        ["3", "None", "()", "'x'", "(-1,)", "(0.5,)", "(1, 1)", "(nan,)", "object()"],
    )
    owner = "agents/experiments/store.py"
    head = "from agents.experiments.store import read"
    made += _after(
        owner,
        head,
        "read(«»)",
        ["None", "3", "Path('missing')", "Path('.')", "Path('/dev/null')", "'x'", "Path('a\\0b')"],
    )
    return made


def _explorer() -> list[Case]:
    owner = "agents/explorer/settings.py"
    head = "from agents.explorer.settings import parse"
    values = [
        "''",
        "'x'",
        "'nan'",
        "'inf'",
        "'-1'",
        "'1e999'",
        "'9' * 5000",
        "'1_0'",
        "' '",
        "'٣'",
        "'None'",
        "'none'",
        "'0.5'",
        "'\\0'",
    ]
    made: list[Case] = []
    for name in ("neuron", "rule", "trials", "seed", "pattern_seed", "mute", "shown", "bounds", "initial_weight",
                 "n.alpha", "n.h", "n.readout", "r.learning_rate", "r.momentum", "r.trace_decay", "t.n_inputs",
                 "t.n_classes", "t.rate", "t.targets", "t.rates", "n.bogus", "r.", ".", "bogus", "x.y", "weight_bounds"):  # fmt: skip
        made += _after(owner, head, f"parse({{{name!r}: «»}}).agent()", values)
    made += _after(owner, head, "parse(«»).agent()", [
        "{'neuron': 'network', 'rule': 'all'}", "{'neuron': 'os:system'}", "{'neuron': '/etc/hostname:A'}",
        "{'bounds': '0,1,2'}", "{'bounds': '1,0'}", "{'bounds': ','}", "{'t.targets': '1 2'}", "{'t.n_inputs': '100000000', 't.rate': '1'}",
        "{'t.targets': '1,x'}", "{'neuron': 'lif', 'n.alpha': '2'}", "{'neuron': 'lif', 'n.eta': '1'}",
    ])  # fmt: skip
    # A number may be written in any way that Python reads, and many settings take these.
    return fine(
        made,
        "'1_0'",
        "'٣'",
        "'none'",
        "'inf'",
        "'0.5'",
        "'-1'",
        "'9' * 5000",
        "'1e999'",
        "t.targets': ''",
        "t.targets': ' '",
        "t.rates': ''",
        "t.rates': ' '",
        "100000000",
    )


def _rl() -> list[Case]:
    made: list[Case] = []
    owner = "agents/rl/hyperparameters.py"
    head = "from agents.rl import make_rl_agent, training_env"
    made += _after(owner, head, "training_env(«»)", [
        "None, patterns", "task, None", "3, 3", "Task(), patterns", "task, patterns, 'bogus'", "task, patterns, None",
        "task, patterns, feedback='bogus'", "task, patterns, feedback='sign'", "task, patterns, feedback=3",
        "task, patterns, n_envs=0", "task, patterns, n_envs='x'", "task, patterns, n_envs=2.5", "task, patterns, n_envs=2**62",
        "task, patterns, n_envs=True", "task, patterns, bogus=1",
    ])  # fmt: skip
    make = "make_rl_agent('ppo', training_env(task, patterns, n_envs=2)«»)"
    made += _after(owner, head, make, [f", {v}" for v in (
        "seed=-1", "seed='x'", "seed=nan", "seed=2.5", "seed=None", "spike_probability=0", "spike_probability=1",
        "spike_probability='x'", "spike_probability=nan", "spike_probability=None", "bogus=1",
    )])  # fmt: skip
    made += _after(owner, head, "make_rl_agent(«»)", [
        "'bogus', trial_env()", "None, trial_env()", "'ppo', None", "'ppo', 3", "'ppo', vector()", "'ppo', 'CartPole-v1'",
        "'ppo', trial_env(output='graded')", "'ppo', SynapticTrace(trial_env(), (0.3,))",
        "'recurrent-ppo', training_env(task, patterns)", "'ppo', training_env(task, patterns, 'recurrent-ppo')",
    ])  # fmt: skip
    owner = "agents/rl/vec_env.py"
    head = "from agents.rl.vec_env import PatternVecEnv"
    same = "PatternVecEnv(vector(autoreset_mode=gym.vector.AutoresetMode.SAME_STEP))"
    made += _after(
        owner, head, "PatternVecEnv(«»)", ["None", "3", "trial_env()", "vector()", "object()"]
    )
    made += _after(owner, head, f"env = {same}\nenv.reset()\nenv.step(«»)", [
        "None", "np.zeros(2, int)", "np.full(3, 2)", "np.full(3, 0.5)", "np.full(3, nan)", "'010'", "[0, 1, 'x']", "np.zeros((3, 2), int)",
    ])  # fmt: skip
    made += _after(
        owner, head, f"env = {same}\nenv.seed(«»)\nenv.reset()", ["-1", "'x'", "2.5", "nan"]
    )
    made += _after(owner, head, f"env = {same}\nenv.«»", [
        "step(np.zeros(3, int))", "set_attr('task', 3, [0])", "env_method('reset')", "get_attr('task', 7)",
    ])  # fmt: skip
    owner = "agents/rl/checkpoint.py"
    head = "from agents.rl import load"
    made += _after(
        owner,
        head,
        "load(«»)",
        ["None", "3", "'missing'", "'.'", "'/dev/null'", "'a\\0b'", "object()", "''"],
    )
    write = "import json\nPath('task.json').write_text(«»)\nload('.')"
    made += _after(owner, head, write, [
        "''", "'x'", "'[]'", "'{}'", "'3'", "'null'", "'{\"format\": 2}'", "'{\"format\": 99}'", "'[' * 100000",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': {}, 'patterns': []})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': 3, 'patterns': []})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': {'n_inputs': 10**8, 'pattern_bins': 10**8}, 'patterns': []})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': {}, 'patterns': [[0, 0, 2**40]]})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': {}, 'patterns': [[0, 0, -1]]})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': {}, 'feedback': 'cost', 'task': {}, 'patterns': 'x'})",
        "json.dumps({'format': 2, 'kind': ['ppo'], 'observation': {}, 'feedback': 'cost', 'task': {}, 'patterns': []})",
        "json.dumps({'format': 2, 'kind': 'ppo', 'observation': 3, 'feedback': 'cost', 'task': {}, 'patterns': []})",
        "json.dumps({'format': 1, 'kind': 'ppo', 'senses': 3, 'feedback': 'cost', 'task': {}, 'patterns': []})",
    ])  # fmt: skip
    return made


def _commands() -> list[Case]:
    made: list[Case] = []
    for script, values in {
        "explore.py": ["--port -1 --no-browser", "--port 99999 --no-browser", "--port x", "--bogus", "--import missing",
                       "--no-browser --link neuron=bogus", "--no-browser --link bogus"],
        "watch.py": ["missing --to f.gif", "/etc/hostname --to f.gif", "--bogus", "missing --to f.txt", "missing --hears bogus",
                     "/dev/null --to f.gif", ". --to f.gif"],
        "publish.py": ["--bogus", "--size bogus", "--results missing --report missing --out out"],
        "reference_table.py": ["--bogus", "--size bogus", "--threads 0", "--seeds x", "--seeds -1", "--store /proc/x --seeds 0"],
        "check_report.py": ["missing.html", "--bogus", "a b"],
        "league.py": ["--seeds x", "--seeds 5-1", "--jobs 0", "--steps -1", "--part bogus", "--out /proc/x --so-far"],
        "sweep.py": ["missing.py:mine", "json:loads", "table --seeds x", "table --scheduler nowhere", "table --scheduler tcp://127.0.0.1:1"],
        "evaluate.py": ["missing --cap 0", "missing --trials -1", "missing --seed x", "missing --import missing", "/proc/self/mem"],
        "train.py": ["--trials 10 --runs 2 --out out --import missing", "--trials 10 --runs 2 --out out --neuron missing.py:A",
                     "--trials 10 --runs 2 --out out --targets x", "--trials 10 --runs 2 --out out --resume /etc/hostname"],
        "train_rl.py": ["--steps x --out out", "--resume missing", "--resume /etc", "--runs 0 --steps 1 --out out"],
        "chemistry.py": ["/dev/null", ". --json"],
        "figures.py": ["--out /proc/x --results missing"],
        "report.py": ["--bogus"],
    }.items():  # fmt: skip
        made += [
            Case(f"{script} {v}", f"scripts/{script}", f"command({script!r}, *{v.split()!r})")
            for v in values
        ]
    for words in (
        "bogus", "--bogus", "speech --word bogus", "speech --phrases missing", "speech bogus",
        "speech --phrases /etc/hostname", "speech --runs 0", "speech --learner bogus", "speech --epochs -1",
    ):  # fmt: skip
        made.append(Case(f"gnm {words}", "agents/commands", f"command('gnm', *{words.split()!r})"))
    return made
