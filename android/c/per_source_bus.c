/* A game with a mixer of its own: each source's dry block in, its sound in the room out, and the late reverb as one more bus.
 * Usage: per_source_bus SCENE.obj
 *
 * Renders the same walk twice: as a mix, and apart. Both must be the same sound up to rounding.
 */
#include "foresound.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { FRAMES = 800, TICKS = 60, SOURCES = 2, CHANNELS = 2 };

static void must(ForesoundStatus status, const char *what) {
    if (status != FORESOUND_STATUS_OK) {
        fprintf(stderr, "%s: status %d: %s\n", what, (int)status, foresound_last_error());
        exit(1);
    }
}

/* An engine with two sources in the scene; `apart`: with buses. */
static void make(const char *path, uint32_t apart, uint64_t *engine, uint64_t *renderer, uint32_t *sources) {
    ForesoundOptions options = FORESOUND_OPTIONS_INIT;
    options.rate_hz = 48000;
    options.block_frames = FRAMES;
    options.guide_rays = 256;
    options.schedule = FORESOUND_SCHEDULE_SYNCHRONOUS;
    options.frame_s = 1.0 / 60.0;
    options.limiter = 0;
    options.source_buses = apart;
    uint64_t scene;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, engine, renderer), "engine");
    must(foresound_scene_from_file(path, NULL, NULL, 0, &scene), "scene");
    must(foresound_engine_set_scene(*engine, scene), "set scene");
    must(foresound_close(scene), "close scene");
    must(foresound_source_add(*engine, 5.0f, 1.5f, 3.2f, &sources[0]), "source");
    must(foresound_source_add(*engine, 10.0f, 1.5f, 2.0f, &sources[1]), "source");
}

static void tick(uint64_t engine, int frame) {
    ForesoundPose listener = {0, {12.5f - 0.1f * (float)frame, 1.65f, 0.5f}, {0, 0, 0, 1}};
    must(foresound_engine_tick(engine, &listener, NULL, 0, sizeof listener), "tick");
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    uint64_t mixed, mix_renderer, apart, bus_renderer;
    uint32_t sources[SOURCES], same[SOURCES];
    make(arguments[1], 0, &mixed, &mix_renderer, sources);
    make(arguments[1], 1, &apart, &bus_renderer, same);
    static float dry[SOURCES][FRAMES * TICKS];
    uint32_t state = 12345;
    for (int source = 0; source < SOURCES; source++) {
        for (int n = 0; n < FRAMES * TICKS; n++) {
            state = state * 1664525u + 1013904223u;
            dry[source][n] = ((float)(state >> 16) - 32768.0f) / 262144.0f;
        }
        uint64_t clip;
        must(foresound_clip_from_samples(dry[source], FRAMES * TICKS, 48000, 48000, &clip), "clip");
        must(foresound_source_play(mixed, sources[source], clip, 0), "play");
        must(foresound_close(clip), "close clip");
    }
    static float mix[CHANNELS * FRAMES], sum[CHANNELS * FRAMES], bus[CHANNELS * FRAMES];
    int played[SOURCES] = {0, 0};
    float loudest = 0, worst = 0, own[SOURCES + 1] = {0, 0, 0};
    for (int frame = 0; frame < TICKS; frame++) {
        tick(mixed, frame);
        tick(apart, frame);
        must(foresound_render(mix_renderer, mix, FRAMES, NULL), "render");
        for (int n = 0; n < CHANNELS * FRAMES; n++) sum[n] = 0;
        must(foresound_render_begin(bus_renderer, FRAMES), "begin");
        for (int source = 0; source <= SOURCES; source++) {
            ForesoundBus held = FORESOUND_BUS_SILENT;
            if (source < SOURCES) {
                ForesoundStatus status = foresound_render_source(bus_renderer, same[source], dry[source] + played[source],
                                                                 bus, CHANNELS, FRAMES, &held);
                /* No graphics frame has the source yet: its sound begins later. */
                if (status != FORESOUND_STATUS_STALE_SOURCE) {
                    must(status, "source");
                    if (held != FORESOUND_BUS_OWN) return 3;
                    played[source] += FRAMES;
                }
            } else {
                ForesoundRenderInfo info = FORESOUND_RENDER_INFO_INIT;
                must(foresound_render_reverb(bus_renderer, bus, CHANNELS, FRAMES, &info), "reverb");
                if (info.frames != FRAMES) return 4;
            }
            for (int n = 0; n < CHANNELS * FRAMES; n++) {
                sum[n] += bus[n];
                own[source] = fmaxf(own[source], fabsf(bus[n]));
            }
        }
        for (int n = 0; n < CHANNELS * FRAMES; n++) {
            loudest = fmaxf(loudest, fabsf(mix[n]));
            worst = fmaxf(worst, fabsf(mix[n] - sum[n]));
        }
    }
    /* -100 dB of the loudest sample: rounding, since a bus sums in another order. */
    if (!(loudest > 1e-3f) || !(worst < 1e-5f * loudest)) {
        fprintf(stderr, "off by %g of %g\n", (double)worst, (double)loudest);
        return 5;
    }
    for (int n = 0; n <= SOURCES; n++)
        if (!(own[n] > 0)) return 6;
    must(foresound_close(mix_renderer), "close");
    must(foresound_close(mixed), "close");
    must(foresound_close(bus_renderer), "close");
    must(foresound_close(apart), "close");
    printf("%d blocks: two buses and the reverb are the mix\n", TICKS);
    return 0;
}
