/* The numbers of each source in each graphics frame, for the panner and the reverb of a middleware. Usage: path_numbers SCENE.obj
 *
 * The middleware plays the sounds; the engine's sources are silent. The renderer is driven all the same: it takes the graphics
 * frames.
 */
#include "foresound.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { FRAMES = 800, TICKS = 30, PATHS = 256, KILOHERTZ = 4 };

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
    uint64_t engine, renderer, scene;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer), "engine");
    must(foresound_scene_from_file(arguments[1], NULL, NULL, 0, &scene), "scene");
    must(foresound_engine_set_scene(engine, scene), "set scene");
    must(foresound_close(scene), "close scene");
    uint32_t source, tick;
    must(foresound_source_add(engine, 5.0f, 1.5f, 3.2f, &source), "source");
    must(foresound_engine_take_numbers(engine, &tick), "begin");
    static float block[2 * FRAMES];
    static ForesoundSourcePath paths[PATHS];
    size_t found = 0;
    for (int frame = 0; frame < TICKS; frame++) {
        ForesoundPose listener = {0, {12.5f - 0.2f * (float)frame, 1.65f, 0.5f}, {0, 0, 0, 1}};
        must(foresound_engine_tick(engine, &listener, NULL, 0, sizeof listener), "tick");
        ForesoundRenderInfo info = FORESOUND_RENDER_INFO_INIT;
        must(foresound_render(renderer, block, FRAMES, &info), "render");
        must(foresound_engine_take_numbers(engine, &tick), "numbers");
        ForesoundSourceNumbers numbers = FORESOUND_SOURCE_NUMBERS_INIT;
        must(foresound_source_numbers(engine, source, &numbers), "source's numbers");
        must(foresound_source_paths(engine, source, paths, sizeof paths[0], PATHS, &found), "source's paths");
        if (found != (numbers.path_count < PATHS ? numbers.path_count : PATHS)) return 3;
        for (size_t n = 0; n < found; n++) {
            float length = 0;
            for (int axis = 0; axis < 3; axis++) length += paths[n].arrival[axis] * paths[n].arrival[axis];
            if (length < 0.99f || length > 1.01f || paths[n].delay_s <= 0 || paths[n].kind > 3) return 4;
        }
        if (frame % 10 == 9)
            printf("frame %" PRIu32 ": %zu paths, occlusion %.1f, reverb %.3f after %.0f ms, T60 %.2f s\n", tick, found,
                   (double)numbers.occlusion, (double)numbers.reverb_send[KILOHERTZ],
                   1e3 * (double)numbers.reverb_delay_s, (double)numbers.decay_time_s[KILOHERTZ]);
    }
    if (found == 0 || tick == 0) return 5;
    must(foresound_close(renderer), "close renderer");
    must(foresound_close(engine), "close engine");
    printf("%d frames of numbers\n", TICKS);
    return 0;
}
