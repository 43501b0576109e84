#!/usr/bin/env python3
"""Makes the dry test signals of `assets/speech` and `assets/signals`.

Takes   espeak-ng 1.51 and sox 14.4.2 on the path, numpy, and two unpacked packages:
        npm resonance-audio 1.0.0 and Debian sonic-pi-samples 3.2.2~repack-8.
Gives   sixteen voices, one recorded voice, music and percussion: 44.1 kHz, 16 bit, mono.
Promise every file starts and ends at zero, so it loops without a click; its active level is
        `ACTIVE_LEVEL_DBFS` unless the peak ceiling stands lower, which is printed.

    python3 assets/speech/make.py --resonance DIR --sonic-pi DIR [--out assets]

The synthesis is deterministic for one version of espeak-ng and its data; another version may
speak with other samples. The texts are our own.
"""

import argparse
import pathlib
import subprocess
import tempfile
import wave

import numpy as np

RATE_HZ = 44_100
ACTIVE_LEVEL_DBFS = -23.0
PEAK_CEILING_DBFS = -3.0
# Silence kept on either side of what sounds; a loop therefore pauses twice this.
MARGIN_S = 0.06
FADE_S = 0.005
# Below the loudest 5 ms by this much counts as silence when the ends are trimmed.
SILENCE_DB = 45.0
# Distance of the activity threshold below the active level: ITU-T P.56, adapted to 20 ms
# blocks instead of its two-pole envelope.
ACTIVITY_MARGIN_DB = 15.9
VOICE_DURATION_S = (5.0, 6.0)

# (voice+variant, pitch 0..99, words a minute, text)
VOICES = [
    ("en-us+male1", 42, 194, "The museum closes at nine tonight, so let us begin with the long gallery and save the clocks for last."),
    ("en-gb+female2", 55, 155, "Could you carry the lantern a little higher? There are nineteen steps, and the seventh one is loose."),
    ("en-us+male4", 30, 192, "Every evening the old ferry crossed the bay, its engine coughing twice before the harbour lights came on."),
    ("en-gb-scotland+male6", 38, 165, "We measured the hall three times, and each time the echo arrived exactly where the drawing said it would."),
    ("en-us+female4", 62, 182, "Fresh peaches, ripe figs, sharp cheese, and a loaf of bread: that is all we need for the journey."),
    ("en-gb-x-rp+Andy", 46, 191, "Please stand behind the yellow line. The next train does not stop here and will pass at high speed."),
    ("en-us+Annie", 70, 166, "My sister keeps six bees in a shoebox, and she swears that each of them answers to its own name."),
    ("en-gb+klatt2", 35, 165, "A soft rain fell on the tin roof, tapping out patterns that nobody in the kitchen bothered to count."),
    ("de+male3", 40, 172, "Im Herbst ziehen die Kraniche über das Tal, und abends hört man ihre Rufe bis hinunter zum Fluss."),
    ("fr-fr+female5", 58, 135, "Quand le vent se lève sur la place, les volets claquent et les pigeons quittent le toit de l'église."),
    ("es+male7", 44, 160, "La biblioteca guarda un mapa antiguo donde el río todavía pasa por el centro de la plaza mayor."),
    ("it+female3", 66, 181, "Nel cortile della scuola i ragazzi cantano piano, mentre la maestra cerca le chiavi del pianoforte."),
    ("sv+male2", 50, 186, "På vintern går vi över isen till ön, tänder en eld och kokar kaffe medan stjärnorna blir fler."),
    ("pt-br+Linda", 60, 169, "Depois da chuva, o cheiro da terra molhada entrava pela janela e ninguém queria voltar ao trabalho."),
    ("en-us+grandpa", 28, 175, "When I was a boy, this whole street was orchards, and you could walk to the sea on fallen apples."),
    ("en-029+Michael", 48, 153, "Turn left after the bridge, follow the singing, and knock on the blue door until somebody laughs."),
]


def read_mono(path, rate_hz=RATE_HZ):
    """Any file that sox reads, as mono float samples at `rate_hz`."""
    raw = subprocess.run(
        ["sox", "-D", str(path), "-t", "f64", "-L", "-", "gain", "-3", "remix", "-", "rate", "-v", str(rate_hz)],
        check=True, capture_output=True,
    ).stdout
    return np.frombuffer(raw, dtype="<f8").copy()


def active_level_db(x):
    """Level in dBFS of the 20 ms blocks that stand above the activity threshold."""
    block = RATE_HZ // 50
    energy = np.mean(x[: len(x) // block * block].reshape(-1, block) ** 2, axis=1)
    level_db = 10 * np.log10(energy.mean())
    for _ in range(50):
        active = energy[10 * np.log10(energy + 1e-20) > level_db - ACTIVITY_MARGIN_DB]
        level_db = 10 * np.log10(active.mean())
    return level_db


def trim(x):
    """Cuts the silence at both ends down to `MARGIN_S`, adding zeros where there is less."""
    hop = RATE_HZ // 200
    peak = np.max(np.abs(x[: len(x) // hop * hop].reshape(-1, hop)), axis=1)
    sounding = np.flatnonzero(peak > peak.max() * 10 ** (-SILENCE_DB / 20))
    margin = round(MARGIN_S * RATE_HZ)
    padded = np.concatenate([np.zeros(margin), x, np.zeros(margin)])
    return padded[sounding[0] * hop : (sounding[-1] + 1) * hop + 2 * margin]


def finish(x):
    """Removes the mean, fades the ends and sets the level."""
    x = x - x.mean()
    fade = round(FADE_S * RATE_HZ)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade) / fade)
    x[:fade] *= ramp
    x[-fade:] *= ramp[::-1]
    gain_db = ACTIVE_LEVEL_DBFS - active_level_db(x)
    ceiling_db = PEAK_CEILING_DBFS - 20 * np.log10(np.abs(x).max())
    return x * 10 ** (min(gain_db, ceiling_db) / 20)


def write(path, x):
    samples = np.round(x * 32767).astype("<i2")
    path.parent.mkdir(parents=True, exist_ok=True)
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(RATE_HZ)
        out.writeframes(samples.tobytes())
    y = samples / 32768
    print(f"{path.name:16s} {len(y) / RATE_HZ:6.3f} s  active {active_level_db(y):6.2f} dBFS"
          f"  peak {20 * np.log10(np.abs(y).max()):6.2f} dBFS  ends {samples[0]} {samples[-1]}")


def speak(voice, pitch, words_a_minute, text):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "speech.wav"
        subprocess.run(
            ["espeak-ng", "-v", voice, "-p", str(pitch), "-s", str(words_a_minute), "-w", str(path), text],
            check=True,
        )
        return read_mono(path)


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--resonance", type=pathlib.Path, required=True)
    arguments.add_argument("--sonic-pi", type=pathlib.Path, required=True)
    arguments.add_argument("--out", type=pathlib.Path, default=pathlib.Path("assets"))
    given = arguments.parse_args()

    for number, voice in enumerate(VOICES, start=1):
        x = trim(speak(*voice))
        if not VOICE_DURATION_S[0] <= len(x) / RATE_HZ <= VOICE_DURATION_S[1]:
            raise SystemExit(f"voice {number}: {len(x) / RATE_HZ:.2f} s, change its speed")
        write(given.out / f"speech/voice{number:02d}.wav", finish(x))

    resources = given.resonance / "examples/resources"
    write(given.out / "speech/recording.wav", finish(trim(read_mono(resources / "speech-sample.wav"))))

    # The beat is 0.667 s (peak of the onset autocorrelation), so twelve beats loop in time.
    music = read_mono(resources / "music.wav")
    write(given.out / "signals/music.wav", finish(music[: round(8.0 * RATE_HZ)]))

    # Four phrases of equal length; two of them loop as well.
    tabla = read_mono(given.sonic_pi / "usr/share/sonic-pi/samples/loop_tabla.flac")
    write(given.out / "signals/percussion.wav", finish(tabla[: len(tabla) // 2]))


if __name__ == "__main__":
    main()
