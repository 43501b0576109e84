/* Calls every function of foresound.h with null pointers, closed and foreign handles, NaN, and huge sizes. Each call
 * returns an error status and, except for audio functions, leaves a message. Prints the number of errors. */
#include <foresound.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int refused;

static void refuses(const char *what, int line, ForesoundStatus status, int has_message) {
    if (status == FORESOUND_STATUS_OK || status == FORESOUND_STATUS_PANIC) {
        fprintf(stderr, "line %d: %s gave %d\n", line, what, (int)status);
        exit(1);
    }
    if (has_message && strlen(foresound_last_error()) < 6) {
        fprintf(stderr, "line %d: %s has no message\n", line, what);
        exit(1);
    }
    refused++;
}

static void works(const char *what, int line, ForesoundStatus status) {
    if (status != FORESOUND_STATUS_OK) {
        fprintf(stderr, "line %d: %s gave %d: %s\n", line, what, (int)status, foresound_last_error());
        exit(1);
    }
}

#define NO(call) refuses(#call, __LINE__, (call), 1)
#define QUIET_NO(call) refuses(#call, __LINE__, (call), 0)
#define YES(call) works(#call, __LINE__, (call))

#define HUGE_COUNT ((size_t)-1 / 8)

/* Every function with an engine handle, with an invalid one. */
static void no_engine(uint64_t engine, uint64_t scene, uint64_t clip) {
    ForesoundPose pose = {0, {0, 1, 0}, {0, 0, 0, 1}};
    ForesoundEngineStatistics statistics = FORESOUND_ENGINE_STATISTICS_INIT;
    ForesoundEngineHealth health = FORESOUND_ENGINE_HEALTH_INIT;
    ForesoundShownPath path;
    size_t count = 0;
    uint32_t source = 0, instance = 0;
    uint64_t stream = 0;
    NO(foresound_engine_tick(engine, &pose, &pose, 1, sizeof pose));
    NO(foresound_engine_set_scene(engine, scene));
    NO(foresound_engine_set_propagation(engine, NULL));
    NO(foresound_engine_pause(engine));
    NO(foresound_engine_resume(engine));
    NO(foresound_engine_restart(engine));
    NO(foresound_engine_statistics(engine, &statistics));
    NO(foresound_engine_health(engine, &health));
    NO(foresound_engine_set_budget(engine, NULL));
    NO(foresound_engine_paths(engine, &path, sizeof path, 1, &count));
    NO(foresound_instance_add(engine, scene, &pose, sizeof pose, &instance));
    NO(foresound_instance_add_joined(engine, scene, &pose, sizeof pose, &instance));
    NO(foresound_instance_move(engine, 0, &pose, sizeof pose));
    NO(foresound_instance_remove(engine, 0));
    NO(foresound_source_add(engine, 0, 0, 0, &source));
    NO(foresound_source_remove(engine, 0));
    NO(foresound_source_configure(engine, 0, NULL));
    NO(foresound_engine_set_predictor(engine, FORESOUND_PREDICTOR_HOLD));
    NO(foresound_engine_set_schedule(engine, FORESOUND_SCHEDULE_SYNCHRONOUS));
    NO(foresound_source_set_directivity_table(engine, 0, NULL, 0));
    NO(foresound_source_set_gain(engine, 0, 1));
    NO(foresound_source_mute(engine, 0, 1));
    NO(foresound_source_play(engine, 0, clip, 1));
    NO(foresound_source_stop(engine, 0));
    NO(foresound_source_stream(engine, 0, 64, &stream));
}

int main(void) {
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 0, 1};
    const float invalid_corners[9] = {0, NAN, 0, 1, INFINITY, 0, 0, 0, 1};
    const uint32_t triangle[3] = {0, 1, 2};
    const uint32_t beyond[3] = {0, 1, 3};
    const char *names[1] = {NULL};
    const char *name[1] = {"brick"};
    const uint32_t materials[1] = {7};
    float block[128] = {0};
    float done = 0;
    uint64_t progress = 0, engine = 0, renderer = 0, scene = 0, clip = 0, stream = 0, output = 0, other = 0;
    uint32_t source = 0, frames = 0, instance = 0;
    size_t count = 0;
    ForesoundSceneInfo info = FORESOUND_SCENE_INFO_INIT;
    ForesoundOutputInfo played = FORESOUND_OUTPUT_INFO_INIT;
    ForesoundEngineStatistics statistics = FORESOUND_ENGINE_STATISTICS_INIT;
    ForesoundEngineHealth health = FORESOUND_ENGINE_HEALTH_INIT;
    ForesoundShownPath path;
    ForesoundOptions options = FORESOUND_OPTIONS_INIT, unsized;
    ForesoundRenderInfo rendered = FORESOUND_RENDER_INFO_INIT;
    ForesoundPropagationOptions rays = FORESOUND_PROPAGATION_OPTIONS_INIT;
    ForesoundSourceOptions like = FORESOUND_SOURCE_OPTIONS_INIT;
    ForesoundBudgetOptions budget = FORESOUND_BUDGET_OPTIONS_INIT;
    ForesoundSceneOptions up = FORESOUND_SCENE_OPTIONS_INIT;
    ForesoundPose pose = {0, {0, 1, 0}, {0, 0, 0, 1}};
    ForesoundPose nowhere = {0, {NAN, 1e30f, 0}, {0, 0, 0, 1}};

    if (foresound_version() != FORESOUND_API_VERSION || foresound_last_error()[0] != 0) return 2;
    YES(foresound_options_default(&options));
    YES(foresound_source_options_default(&like));
    YES(foresound_budget_options_default(&budget));
    YES(foresound_scene_options_default(&up));
    YES(foresound_propagation_options_default(&rays));
    memset(&unsized, 0xa5, sizeof unsized);
    NO(foresound_options_default(&unsized));
    NO(foresound_propagation_options_default(NULL));
    NO(foresound_options_default(NULL));
    NO(foresound_source_options_default(NULL));
    NO(foresound_budget_options_default(NULL));
    NO(foresound_scene_options_default(NULL));

    /* Creation. */
    options.max_sources = 2;
    NO(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, NULL, &renderer));
    NO(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, NULL));
    NO(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 9, &engine, &renderer));
    NO(foresound_engine_create(FORESOUND_API_VERSION, &options, (const uint8_t *)block, 9, &engine, &renderer));
    NO(foresound_engine_create(FORESOUND_API_VERSION, &options, (const uint8_t *)block, HUGE_COUNT * 8, &engine, &renderer));
    ForesoundOptions wrong;
#define WRONG(field, value)                                             \
    wrong = options;                                                    \
    wrong.field = (value);                                              \
    NO(foresound_engine_create(FORESOUND_API_VERSION, &wrong, NULL, 0, &engine, &renderer));   \
    if (engine != 0 || renderer != 0) return 3
    WRONG(size, 0);
    WRONG(size, 1u << 30);
    WRONG(rate_hz, 0);
    WRONG(rate_hz, 0xffffffffu);
    WRONG(block_frames, 0);
    WRONG(max_sources, 0);
    WRONG(max_sources, 0xffffffffu);
    WRONG(max_voices, 0);
    WRONG(max_paths, 0xffffffffu);
    WRONG(guide_rays, 0);
    WRONG(depth, 99);
    WRONG(schedule, 2);
    WRONG(predictor, 3);
    WRONG(affinity, 3);
    WRONG(hrtf, 2);
    WRONG(late_reverb, 2);
    WRONG(limiter, 2);
    WRONG(min_distance_m, NAN);
    WRONG(ceiling_db, 1);
    WRONG(frame_s, NAN);
    WRONG(frame_s, -1);
    WRONG(max_delay_s, INFINITY);
    WRONG(device_hints, 4);
    WRONG(source_slots, 257);
    WRONG(tracing_threads, 0);
    WRONG(diffraction_order, 3);
    WRONG(even_blocks, 2);
    WRONG(shown_paths, 0xffffffffu);
    YES(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer));

    /* Scenes. */
#define MESH(p, n, i, k, t, names, m, toml) foresound_scene_from_mesh(p, n, i, k, t, names, m, toml, NULL, 0, &scene)
    NO(MESH(NULL, 3, triangle, 3, NULL, NULL, 0, NULL));
    NO(MESH(corners, 3, NULL, 3, NULL, NULL, 0, NULL));
    NO(MESH(corners, 0, triangle, 0, NULL, NULL, 0, NULL));
    NO(MESH(corners, 3, triangle, 2, NULL, NULL, 0, NULL));
    NO(MESH(corners, 3, beyond, 3, NULL, NULL, 0, NULL));
    NO(MESH(corners, HUGE_COUNT, triangle, 3, NULL, NULL, 0, NULL));
    NO(MESH(corners, 3, triangle, (size_t)-1, NULL, NULL, 0, NULL));
    NO(MESH((const float *)((const char *)corners + 1), 2, triangle, 3, NULL, NULL, 0, NULL));
    NO(MESH(invalid_corners, 3, triangle, 3, NULL, NULL, 0, NULL));
    NO(MESH(corners, 3, triangle, 3, materials, names, 1, NULL));
    NO(MESH(corners, 3, triangle, 3, materials, name, 1, NULL));
    NO(MESH(corners, 3, triangle, 3, NULL, name, 1, NULL));
    NO(MESH(corners, 3, triangle, 3, NULL, NULL, 0, "[what"));
    NO(MESH(corners, 3, triangle, 3, NULL, NULL, 0, "\xff\xfe"));
    NO(foresound_scene_from_mesh(corners, 3, triangle, 3, NULL, NULL, 0, NULL, NULL, 0, NULL));
    up.temperature_c = NAN;
    NO(foresound_scene_from_mesh(corners, 3, triangle, 3, NULL, NULL, 0, NULL, &up, 0, &scene));
    NO(foresound_scene_from_file(NULL, NULL, NULL, 0, &scene));
    NO(foresound_scene_from_file("/no/such.obj", NULL, NULL, 0, &scene));
    NO(foresound_scene_from_file("", NULL, NULL, 0, &scene));
    NO(foresound_scene_from_file("/", NULL, NULL, 0, NULL));
    YES(MESH(corners, 3, triangle, 3, NULL, NULL, 0, NULL));
    NO(foresound_scene_info(scene, NULL));
    NO(foresound_scene_save(scene, NULL));
    NO(foresound_scene_save(scene, "/no/such/folder/scene"));
    NO(foresound_scene_save(0, "scene"));
    NO(foresound_scene_from_bytes(NULL, 9, &progress));
    NO(foresound_scene_from_bytes((const uint8_t *)"no scene", 8, &progress));
    NO(foresound_scene_from_bytes((const uint8_t *)"no scene", 8, NULL));
    NO(foresound_progress_create(NULL));
    YES(foresound_progress_create(&progress));
    NO(foresound_progress_read(progress, NULL));
    NO(foresound_progress_read(scene, &done));
    NO(foresound_progress_cancel(scene));
    YES(foresound_progress_cancel(progress));
    NO(foresound_scene_from_mesh(corners, 3, triangle, 3, NULL, NULL, 0, NULL, NULL, progress, &other));
    NO(foresound_scene_from_mesh(corners, 3, triangle, 3, NULL, NULL, 0, NULL, NULL, scene, &other));
    YES(foresound_close(progress));
    NO(foresound_progress_cancel(progress));
    NO(foresound_set_log(5, NULL, NULL));

    /* Sources, clips, streams. */
    NO(foresound_source_add(engine, 0, 0, 0, NULL));
    NO(foresound_source_add(engine, NAN, 0, 0, &source));
    NO(foresound_source_add(engine, 1e30f, 0, 0, &source));
    YES(foresound_source_add(engine, 0, 1, 2, &source));
    NO(foresound_source_set_gain(engine, source, NAN));
    NO(foresound_source_set_gain(engine, source, -1));
    NO(foresound_source_set_gain(engine, source, 1e9f));
    NO(foresound_source_set_gain(engine, source + 1, 1));
    NO(foresound_source_remove(engine, 0xffffffffu));
    NO(foresound_source_set_directivity_table(engine, source, NULL, 16));
    NO(foresound_source_set_directivity_table(engine, source, block, 17));
    NO(foresound_source_set_directivity_table(engine, source, block, 8));
    NO(foresound_source_set_directivity_table(engine, source, block, HUGE_COUNT));
    YES(foresound_source_set_directivity_table(engine, source, block, 16));
    YES(foresound_source_set_directivity_table(engine, source, NULL, 0));
    like.order = NAN;
    NO(foresound_source_configure(engine, source, &like));
    NO(foresound_clip_from_samples(NULL, 8, 48000, 48000, &clip));
    NO(foresound_clip_from_samples(block, 8, 0, 48000, &clip));
    NO(foresound_clip_from_samples(block, 8, 48000, 0xffffffffu, &clip));
    NO(foresound_clip_from_samples(block, HUGE_COUNT, 48000, 48000, &clip));
    NO(foresound_clip_from_samples(block, 8, 48000, 48000, NULL));
    block[0] = NAN;
    NO(foresound_clip_from_samples(block, 8, 48000, 48000, &clip));
    block[0] = 0;
    NO(foresound_clip_from_wav(NULL, 8, 48000, &clip));
    NO(foresound_clip_from_wav((const uint8_t *)block, sizeof block, 48000, &clip));
    NO(foresound_clip_from_wav((const uint8_t *)block, 0, 48000, &clip));
    YES(foresound_clip_from_samples(block, 8, options.rate_hz, options.rate_hz, &clip));
    NO(foresound_source_play(engine, source, scene, 1));
    NO(foresound_source_stream(engine, source, 0, &stream));
    NO(foresound_source_stream(engine, source, HUGE_COUNT, &stream));
    NO(foresound_source_stream(engine, source, 64, NULL));
    YES(foresound_source_stream(engine, source, 64, &stream));

    /* Instances. */
    NO(foresound_instance_add(engine, scene, NULL, sizeof pose, &instance));
    NO(foresound_instance_add(engine, scene, &pose, sizeof pose, NULL));
    NO(foresound_instance_add(engine, scene, &nowhere, sizeof pose, &instance));
    NO(foresound_instance_add(engine, clip, &pose, sizeof pose, &instance));
    NO(foresound_instance_add(engine, 0, &pose, sizeof pose, &instance));
    NO(foresound_instance_add_joined(engine, scene, NULL, sizeof pose, &instance));
    NO(foresound_instance_add_joined(engine, scene, &nowhere, sizeof pose, &instance));
    NO(foresound_instance_add_joined(engine, clip, &pose, sizeof pose, &instance));
    YES(foresound_instance_add_joined(engine, scene, &pose, sizeof pose, &instance));
    YES(foresound_instance_remove(engine, instance));
    YES(foresound_instance_add(engine, scene, &pose, sizeof pose, &instance));
    NO(foresound_instance_move(engine, instance, NULL, sizeof pose));
    NO(foresound_instance_move(engine, instance, &nowhere, sizeof pose));
    NO(foresound_instance_move(engine, instance, &pose, 0));
    NO(foresound_instance_move(engine, instance, &pose, (size_t)-1));
    NO(foresound_instance_move(engine, instance + 1, &pose, sizeof pose));
    pose.orientation[0] = 3;
    NO(foresound_instance_move(engine, instance, &pose, sizeof pose));
    pose.orientation[0] = 0;
    YES(foresound_instance_move(engine, instance, &pose, sizeof pose));
    NO(foresound_instance_remove(engine, 0xffffffffu));
    YES(foresound_instance_remove(engine, instance));
    NO(foresound_instance_remove(engine, instance));

    /* The engine. */
    NO(foresound_engine_tick(engine, NULL, NULL, 0, sizeof pose));
    NO(foresound_engine_tick(engine, &pose, NULL, 1, sizeof pose));
    NO(foresound_engine_tick(engine, &pose, &pose, HUGE_COUNT, sizeof pose));
    NO(foresound_engine_tick(engine, &nowhere, NULL, 0, sizeof pose));
    nowhere.source = source;
    NO(foresound_engine_tick(engine, &pose, &nowhere, 1, sizeof pose));
    NO(foresound_engine_set_scene(engine, clip));
    rays.guide_rays = 0;
    NO(foresound_engine_set_propagation(engine, &rays));
    rays.guide_rays = 1;
    rays.depth = 0xffffffffu;
    NO(foresound_engine_set_propagation(engine, &rays));
    rays.depth = 1;
    rays.size = 3;
    NO(foresound_engine_set_propagation(engine, &rays));
    NO(foresound_engine_set_predictor(engine, 3));
    NO(foresound_engine_set_schedule(engine, 2));
    NO(foresound_engine_tick(engine, &pose, NULL, 0, 0));
    NO(foresound_engine_tick(engine, &pose, NULL, 0, 31));
    NO(foresound_engine_tick(engine, &pose, &pose, 1, (size_t)-4));
    NO(foresound_engine_statistics(engine, NULL));
    NO(foresound_engine_health(engine, NULL));
    NO(foresound_engine_paths(engine, NULL, sizeof path, 1, &count));
    NO(foresound_engine_paths(engine, &path, sizeof path, HUGE_COUNT, &count));
    NO(foresound_engine_paths(engine, &path, sizeof path, 1, NULL));
    budget.quality_level = 6;
    NO(foresound_engine_set_budget(engine, &budget));
    budget.quality_level = 0;
    budget.fixed = 2;
    NO(foresound_engine_set_budget(engine, &budget));
    budget.fixed = 0;
    budget.update_s = NAN;
    NO(foresound_engine_set_budget(engine, &budget));
    budget.update_s = 0;
    budget.core_share = 1e300;
    NO(foresound_engine_set_budget(engine, &budget));
    budget.core_share = 0;
    budget.reserved = 1;
    NO(foresound_engine_set_budget(engine, &budget));
    budget.reserved = 0;
    YES(foresound_engine_set_budget(engine, &budget));
    YES(foresound_engine_statistics(engine, &statistics));
    YES(foresound_engine_health(engine, &health));
    NO(foresound_engine_paths(engine, &path, 0, 1, &count));
    NO(foresound_engine_paths(engine, &path, sizeof path - 1, 1, &count));
    YES(foresound_engine_paths(engine, NULL, sizeof path, 0, &count));

    /* Audio functions, which leave no message. */
    QUIET_NO(foresound_render(renderer, NULL, 1, NULL));
    QUIET_NO(foresound_render(renderer, block, HUGE_COUNT, NULL));
    QUIET_NO(foresound_render(renderer, (float *)((char *)block + 1), 1, NULL));
    QUIET_NO(foresound_render(engine, block, 1, NULL));
    rendered.size = 0;
    QUIET_NO(foresound_render(renderer, block, 1, &rendered));
    rendered.size = 13;
    QUIET_NO(foresound_render(renderer, block, 1, &rendered));
    QUIET_NO(foresound_render(renderer, block, 1, (ForesoundRenderInfo *)((char *)&rendered + 1)));
    rendered.size = sizeof rendered;
    YES(foresound_render(renderer, block, 1, &rendered));
    QUIET_NO(foresound_stream_write(stream, NULL, 1, &count));
    QUIET_NO(foresound_stream_write(stream, block, HUGE_COUNT, &count));
    QUIET_NO(foresound_stream_write(clip, block, 1, &count));
    NO(foresound_renderer_latency(renderer, NULL));
    NO(foresound_renderer_latency(scene, &frames));
    NO(foresound_output_start(renderer, 0, &output));
    NO(foresound_output_start(renderer, HUGE_COUNT, &output));
    NO(foresound_output_start(renderer, 2, NULL));
    NO(foresound_output_start(engine, 2, &output));
    YES(foresound_output_start(renderer, 2, &output));
    NO(foresound_output_info(output, NULL));
    NO(foresound_output_info(engine, &played));
    YES(foresound_output_info(output, &played));

    /* Invented, foreign and closed handles. */
    const uint64_t handles[] = {0, 1, UINT64_MAX, 1ull << 63, engine ^ 1, engine ^ 1ull << 40, scene, clip, stream, renderer};
    for (size_t i = 0; i < sizeof handles / sizeof *handles; i++) no_engine(handles[i], scene, clip);
    for (size_t i = 0; i < 4; i++) {
        other = handles[i];
        NO(foresound_close(other));
        NO(foresound_scene_info(other, &info));
        NO(foresound_renderer_latency(other, &frames));
        NO(foresound_output_info(other, &played));
        QUIET_NO(foresound_render(other, block, 1, NULL));
        QUIET_NO(foresound_stream_write(other, block, 1, &count));
    }
    const uint64_t open[] = {output, stream, clip, scene, engine};
    for (size_t i = 0; i < sizeof open / sizeof *open; i++) {
        YES(foresound_close(open[i]));
        NO(foresound_close(open[i]));
    }
    no_engine(engine, scene, clip);
    printf("abuse refused %d\n", refused);
    return 0;
}
