/* A split screen: two listeners of one engine, each with an output of its own. Usage: split_screen SCENE.obj */
#include "foresound.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { FRAMES = 800, TICKS = 60, CHANNELS = 2, LISTENERS = 2 };

static void must(ForesoundStatus status, const char *what) {
    if (status != FORESOUND_STATUS_OK) {
        fprintf(stderr, "%s: status %d: %s\n", what, (int)status, foresound_last_error());
        exit(1);
    }
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    ForesoundOptions options = FORESOUND_OPTIONS_INIT;
    options.rate_hz = 48000;
    options.guide_rays = 256;
    options.schedule = FORESOUND_SCHEDULE_SYNCHRONOUS;
    options.frame_s = 1.0 / 60.0;
    options.listeners = LISTENERS;
    uint64_t engine, renderer, scene, clip;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer), "engine");
    must(foresound_scene_from_file(arguments[1], NULL, NULL, 0, &scene), "scene");
    must(foresound_engine_set_scene(engine, scene), "set scene");
    must(foresound_close(scene), "close scene");
    uint32_t source;
    must(foresound_source_add(engine, 5.0f, 1.5f, 3.2f, &source), "source");
    static float noise[48000];
    uint32_t state = 12345;
    for (int n = 0; n < 48000; n++) {
        state = state * 1664525u + 1013904223u;
        noise[n] = ((float)(state >> 16) - 32768.0f) / 262144.0f;
    }
    must(foresound_clip_from_samples(noise, 48000, 48000, 48000, &clip), "clip");
    must(foresound_source_play(engine, source, clip, 1), "play");
    must(foresound_close(clip), "close clip");
    /* The first listener beside the source, the second in the next room. */
    static float output[LISTENERS * CHANNELS * FRAMES];
    double energy[LISTENERS] = {0, 0};
    for (int frame = 0; frame < TICKS; frame++) {
        ForesoundPose first = {0, {6.0f, 1.65f, 3.0f}, {0, 0, 0, 1}};
        ForesoundPose second = {0, {12.5f - 0.02f * (float)frame, 1.65f, 0.5f}, {0, 0, 0, 1}};
        must(foresound_engine_set_listener(engine, 1, &second, sizeof second), "second listener");
        must(foresound_engine_tick(engine, &first, NULL, 0, sizeof first), "tick");
        ForesoundRenderInfo info = FORESOUND_RENDER_INFO_INIT;
        must(foresound_render_listeners(renderer, output, LISTENERS, CHANNELS, FRAMES, &info), "render");
        if (info.frames != FRAMES) return 3;
        for (int listener = 0; listener < LISTENERS; listener++)
            for (int n = 0; n < CHANNELS * FRAMES; n++) {
                double sample = output[listener * CHANNELS * FRAMES + n];
                energy[listener] += sample * sample;
            }
    }
    if (!(energy[1] > 0) || !(energy[0] > 10 * energy[1])) return 4;
    if (foresound_engine_set_listener(engine, LISTENERS, &(ForesoundPose){0, {0, 0, 0}, {0, 0, 0, 1}},
                                      sizeof(ForesoundPose)) != FORESOUND_STATUS_BAD_ARGUMENT)
        return 5;
    must(foresound_close(renderer), "close renderer");
    must(foresound_close(engine), "close engine");
    printf("the second listener is %.1f dB below the first\n", 10 * log10(energy[0] / energy[1]));
    return 0;
}
