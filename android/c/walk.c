/* An example of the C interface: the walk of android/jvm/reference.rs, with the same bits. Usage: walk SCENE.obj OUT.raw
 *
 * A game calls foresound_engine_tick from its frame loop, and passes the renderer to foresound_output_start or calls
 * foresound_render from its audio callback.
 */
#include "foresound.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { RATE_HZ = 48000, FRAMES = 800, TICKS = 90, SAMPLES = 2 * RATE_HZ };

static void must(ForesoundStatus status, const char *what) {
    if (status != FORESOUND_STATUS_OK) {
        fprintf(stderr, "%s: status %d: %s\n", what, (int)status, foresound_last_error());
        exit(1);
    }
}

static void refused(ForesoundStatus status, ForesoundStatus wanted, const char *what) {
    if (status != wanted) {
        fprintf(stderr, "%s: status %d, not %d\n", what, (int)status, (int)wanted);
        exit(1);
    }
}

/* A panel of 2 m x 2 m that slides through the walk, rotated by a constant angle. */
static const float panel[12] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0};
static const uint32_t panel_triangles[6] = {0, 1, 2, 0, 2, 3};

static float signal_[SAMPLES];
static float block[2 * FRAMES];

int main(int count, char **arguments) {
    if (count != 3) return 2;
    ForesoundOptions options = FORESOUND_OPTIONS_INIT;
    options.rate_hz = RATE_HZ;
    options.guide_rays = 256;
    options.schedule = FORESOUND_SCHEDULE_SYNCHRONOUS;
    options.frame_s = 1.0 / 60.0;
    uint64_t engine, renderer, scene, clip;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer), "engine");
    must(foresound_scene_from_file(arguments[1], NULL, NULL, 0, &scene), "scene");
    must(foresound_engine_set_scene(engine, scene), "set scene");
    must(foresound_close(scene), "close scene");

    uint32_t state = 12345;
    for (int n = 0; n < SAMPLES; n++) {
        state = state * 1664525u + 1013904223u;
        float noise = (float)((int32_t)(state >> 16) - 32768) / 262144.0f;
        signal_[n] = n % 9600 < 8 ? 0.5f : noise;
    }
    must(foresound_clip_from_samples(signal_, SAMPLES, RATE_HZ, RATE_HZ, &clip), "clip");
    uint32_t near_source, far_source;
    must(foresound_source_add(engine, 5.0f, 1.5f, 3.2f, &near_source), "source");
    must(foresound_source_add(engine, 10.0f, 1.5f, 2.0f, &far_source), "source");
    must(foresound_source_play(engine, near_source, clip, 1), "play");
    must(foresound_source_play(engine, far_source, clip, 0), "play");
    must(foresound_close(clip), "close clip");
    must(foresound_source_set_gain(engine, far_source, 0.5f), "gain");

    uint64_t part;
    uint32_t door;
    ForesoundPose swing = {0, {9.0f, 0, 1.0f}, {0, 0.6f, 0, 0.8f}};
    must(foresound_scene_from_mesh(panel, 4, panel_triangles, 6, NULL, NULL, 0, NULL, NULL, 0, &part), "panel");
    must(foresound_instance_add(engine, part, &swing, sizeof swing, &door), "door");
    must(foresound_close(part), "close panel");

    FILE *out = fopen(arguments[2], "wb");
    if (!out) return 4;
    for (int tick = 0; tick < TICKS; tick++) {
        float progress = (float)tick / (float)TICKS;
        ForesoundPose listener = {0, {12.5f - 6.0f * progress, 1.65f, 0.5f + 4.0f * progress}, {0, 0.5f * progress, 0, 1}};
        ForesoundPose moving = {near_source, {5.0f, 1.5f, 3.25f - progress}, {0, 0, 0, 1}};
        swing.position_m[2] = 1.0f + progress;
        must(foresound_instance_move(engine, door, &swing, sizeof swing), "door");
        must(foresound_engine_tick(engine, &listener, &moving, 1, sizeof moving), "tick");
        ForesoundRenderInfo info = FORESOUND_RENDER_INFO_INIT;
        must(foresound_render(renderer, block, FRAMES, &info), "render");
        if (info.frames != FRAMES || fwrite(block, sizeof block, 1, out) != 1) return 5;
    }
    if (fclose(out)) return 6;

    ForesoundEngineStatistics statistics = FORESOUND_ENGINE_STATISTICS_INIT;
    must(foresound_engine_statistics(engine, &statistics), "statistics");
    printf("c updates %" PRIu64 " paths %" PRIu32 "\n", statistics.updates, statistics.paths);

    /* Errors. */
    ForesoundPose bad = {77, {0, 0, 0}, {0, 0, 0, 1}};
    refused(foresound_engine_tick(engine, NULL, NULL, 0, sizeof bad), FORESOUND_STATUS_NULL, "no listener");
    refused(foresound_engine_tick(engine, &bad, &bad, 1, sizeof bad), FORESOUND_STATUS_STALE_SOURCE, "no source");
    must(foresound_instance_remove(engine, door), "remove");
    refused(foresound_instance_remove(engine, door), FORESOUND_STATUS_STALE_INSTANCE, "no door");
    refused(foresound_engine_tick(renderer, &bad, NULL, 0, sizeof bad), FORESOUND_STATUS_WRONG_KIND, "no engine");
    refused(foresound_render(42, block, FRAMES, NULL), FORESOUND_STATUS_CLOSED, "no renderer");
    for (int n = 0; n < 2 * FRAMES; n++)
        if (block[n] != 0.0f) return 7;
    refused(foresound_render(renderer, NULL, 1, NULL), FORESOUND_STATUS_NULL, "no output");
    refused(foresound_scene_from_file("no such.obj", NULL, NULL, 0, &scene), FORESOUND_STATUS_FILE, "no file");
    if (scene != 0 || foresound_last_error()[0] == 0) return 8;
    refused(foresound_engine_create(FORESOUND_API_VERSION + 0x10000u, &options, NULL, 0, &engine, &renderer), FORESOUND_STATUS_VERSION,
            "a caller of another major version");
    options.size = 0;
    refused(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer), FORESOUND_STATUS_BAD_ARGUMENT, "no size");
    options.size = 8; /* The structure of an older header, which ends after the rate. */
    options.rate_hz = 44100;
    options.guide_rays = 0;
    uint64_t engine2, renderer2;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine2, &renderer2), "an old caller's engine");
    must(foresound_close(engine2), "close");
    must(foresound_close(renderer2), "close");
    refused(foresound_close(engine2), FORESOUND_STATUS_CLOSED, "closed twice");
    return 0;
}
