/* A caller of the library, compiled with headers of other layouts than the library's (tests/c_abi.rs): structures are shorter,
 * as an older header's, or longer, as a newer one's. Every structure lies between guard bytes, and at the end of its heap block
 * for AddressSanitizer and valgrind. HAS_<structure>_<field> tells which fields the header has, KNOWN_<structure> how many bytes
 * of the structure the library knows, SCENE_FILE a scene. Prints the number of checks. */
#include "foresound.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 64, FRAMES = 256, PATHS = 4 };

static int checks;

static void check(int is_right, const char *what, int line) {
    checks++;
    if (!is_right) {
        fprintf(stderr, "line %d: %s: %s\n", line, what, foresound_last_error());
        exit(1);
    }
}

#define CHECK(condition) check((condition), #condition, __LINE__)
#define MUST(call) check((call) == FORESOUND_STATUS_OK, #call, __LINE__)
#define REFUSED(call) check((call) == FORESOUND_STATUS_BAD_ARGUMENT, #call, __LINE__)

/* A block of memory that ends with a structure, filled with a pattern. */
typedef struct Guarded {
    unsigned char *block;
    unsigned char *body;
    size_t bytes;
    int fill;
} Guarded;

static Guarded guarded(size_t bytes, int fill) {
    Guarded made;
    made.block = malloc(GUARD + bytes);
    if (!made.block) exit(2);
    memset(made.block, fill, GUARD + bytes);
    made.body = made.block + GUARD;
    made.bytes = bytes;
    made.fill = fill;
    return made;
}

static void release(Guarded *guarded_, int line) {
    for (int i = 0; i < GUARD; i++) check(guarded_->block[i] == guarded_->fill, "the bytes before a structure", line);
    free(guarded_->block);
}

/* A structure to write: every byte of the caller's size is written, none outside; what the library does not know is 0. The call
 * is made with a larger block too, whose bytes behind the structure stay as they are. */
#define OUT(T, known, name, call)                                                                      \
    for (int fill = 0x5a; fill <= 0xa5; fill += 0xa5 - 0x5a) {                                         \
        Guarded exact = guarded(sizeof(T), fill), roomy = guarded(sizeof(T) + GUARD, fill);            \
        T *name = (T *)exact.body;                                                                     \
        name->size = sizeof(T);                                                                        \
        MUST(call);                                                                                    \
        CHECK(name->size == sizeof(T));                                                                \
        for (size_t i = known; i < sizeof(T); i++) CHECK(exact.body[i] == 0);                          \
        name = (T *)roomy.body;                                                                        \
        name->size = sizeof(T);                                                                        \
        MUST(call);                                                                                    \
        for (size_t i = 0; i < GUARD; i++) CHECK(roomy.body[sizeof(T) + i] == fill);                   \
        CHECK(written(exact.body, sizeof(T), fill));                                                   \
        release(&exact, __LINE__);                                                                     \
        release(&roomy, __LINE__);                                                                     \
        wrong_sizes(sizeof(T), known);                                                                 \
        for (int i = 0; i < wrong_count; i++) {                                                        \
            Guarded refused = guarded(known + GUARD, fill);                                            \
            name = (T *)refused.body;                                                                  \
            memcpy(refused.body, &wrong[i], sizeof wrong[i]);                                          \
            check((call) == FORESOUND_STATUS_BAD_ARGUMENT, "a wrong size: " #call, __LINE__);          \
            for (size_t b = sizeof wrong[i]; b < refused.bytes; b++) CHECK(refused.body[b] == fill);   \
            release(&refused, __LINE__);                                                               \
        }                                                                                              \
    }

/* Sizes that no version of a structure has. */
static uint32_t wrong[6];
static int wrong_count;
static void wrong_sizes(size_t callers, size_t known) {
    const uint32_t sizes[6] = {0, 3, 5, (uint32_t)known - 1, 0x5a5a5a5au, 0xffffffffu};
    wrong_count = 0;
    for (int i = 0; i < 6; i++)
        if (sizes[i] != callers) wrong[wrong_count++] = sizes[i];
}

/* Whether no run of eight bytes kept the fill: a value may have a byte of it by chance. */
static int written(const unsigned char *body, size_t bytes, int fill) {
    size_t run = 0;
    for (size_t i = 0; i < bytes; i++) {
        run = body[i] == fill ? run + 1 : 0;
        if (run == 8) return 0;
    }
    return 1;
}

/* A structure to read, from the end of a block: what lies behind is not readable. */
#define IN(T, name, init)                  \
    Guarded name##_guard;                  \
    T *name = NULL;                        \
    {                                      \
        T initial = init;                  \
        name##_guard = guarded(sizeof(T), 0xff); \
        name = (T *)name##_guard.body;     \
        memcpy(name, &initial, sizeof(T)); \
    }

/* The library's defaults are the header's, in the fields that both have. */
#define DEFAULTS(T, known, init, function)                                           \
    OUT(T, known, value, function(value))                                            \
    {                                                                                \
        T initial = init, value;                                                     \
        value.size = sizeof(T);                                                      \
        MUST(function(&value));                                                      \
        CHECK(memcmp(&initial, &value, sizeof(T) < known ? sizeof(T) : known) == 0); \
    }

static int logged;
static void on_message(void *user, ForesoundLogLevel level, const char *message) {
    if (level != FORESOUND_LOG_LEVEL_OFF && message) *(int *)user += 1;
}

static const float corners[12] = {-9, 0, -9, 9, 0, -9, 9, 0, 9, -9, 0, 9};
static const uint32_t triangles[6] = {0, 2, 1, 0, 3, 2};
static float samples[4800];
static float block[2 * FRAMES];

int main(void) {
    uint64_t engine = 0, renderer = 0, scene = 0, clip = 0, output = 0, progress = 0;
    uint32_t source = 0, instance = 0;
    float done = 0;
    MUST(foresound_set_log(FORESOUND_LOG_LEVEL_WARN, on_message, &logged));

    DEFAULTS(ForesoundOptions, KNOWN_Options, FORESOUND_OPTIONS_INIT, foresound_options_default)
    DEFAULTS(ForesoundSourceOptions, KNOWN_SourceOptions, FORESOUND_SOURCE_OPTIONS_INIT, foresound_source_options_default)
    DEFAULTS(ForesoundPropagationOptions, KNOWN_PropagationOptions, FORESOUND_PROPAGATION_OPTIONS_INIT,
             foresound_propagation_options_default)
    DEFAULTS(ForesoundSceneOptions, KNOWN_SceneOptions, FORESOUND_SCENE_OPTIONS_INIT, foresound_scene_options_default)
    DEFAULTS(ForesoundBudgetOptions, KNOWN_BudgetOptions, FORESOUND_BUDGET_OPTIONS_INIT, foresound_budget_options_default)

    IN(ForesoundOptions, options, FORESOUND_OPTIONS_INIT)
#ifdef HAS_Options_rate_hz
    options->rate_hz = 48000;
#endif
#ifdef HAS_Options_max_sources
    options->max_sources = 2;
#endif
#ifdef HAS_Options_hrtf
    options->hrtf = FORESOUND_HRTF_NONE;
#endif
#ifdef HAS_Options_shown_paths
    options->shown_paths = 16;
#endif
    CHECK(foresound_engine_create(FORESOUND_API_VERSION ^ 0x10000u, options, NULL, 0, &engine, &renderer) ==
          FORESOUND_STATUS_VERSION);
    CHECK(engine == 0 && renderer == 0);
    MUST(foresound_engine_create(FORESOUND_API_VERSION + 1, options, NULL, 0, &engine, &renderer));
    CHECK(engine != 0 && renderer != 0);
    const uint32_t right = options->size;
    options->size = 5;
    uint64_t other = 1, another = 1;
    REFUSED(foresound_engine_create(FORESOUND_API_VERSION, options, NULL, 0, &other, &another));
    CHECK(other == 0 && another == 0);
    options->size = right;
    release(&options_guard, __LINE__);
    MUST(foresound_engine_set_schedule(engine, FORESOUND_SCHEDULE_SYNCHRONOUS));

    IN(ForesoundSceneOptions, air, FORESOUND_SCENE_OPTIONS_INIT)
    MUST(foresound_progress_create(&progress));
    MUST(foresound_scene_from_mesh(corners, 4, triangles, 6, NULL, NULL, 0, NULL, air, progress, &scene));
    MUST(foresound_progress_read(progress, &done));
    CHECK(done == 1.0f);
    MUST(foresound_close(progress));
    release(&air_guard, __LINE__);
    OUT(ForesoundSceneInfo, KNOWN_SceneInfo, value, foresound_scene_info(scene, value))
    MUST(foresound_engine_set_scene(engine, scene));

    IN(ForesoundPropagationOptions, rays, FORESOUND_PROPAGATION_OPTIONS_INIT)
    MUST(foresound_engine_set_propagation(engine, rays));
    release(&rays_guard, __LINE__);
    IN(ForesoundBudgetOptions, budget, FORESOUND_BUDGET_OPTIONS_INIT)
    MUST(foresound_engine_set_budget(engine, budget));
    release(&budget_guard, __LINE__);

    MUST(foresound_source_add(engine, 1, 2, 1, &source));
    CHECK(source != 0);
    IN(ForesoundSourceOptions, like, FORESOUND_SOURCE_OPTIONS_INIT)
    MUST(foresound_source_configure(engine, source, like));
    release(&like_guard, __LINE__);
    for (int i = 0; i < 4800; i++) samples[i] = (float)(i % 96) / 96 - 0.5f;
    /* The option of an older header is in force. */
#ifdef HAS_Options_rate_hz
    const uint32_t rate_hz = 48000, other_hz = 44100;
#else
    const uint32_t rate_hz = 44100, other_hz = 48000;
#endif
    MUST(foresound_clip_from_samples(samples, 4800, rate_hz, other_hz, &clip));
    REFUSED(foresound_source_play(engine, source, clip, 1));
    MUST(foresound_close(clip));
    MUST(foresound_clip_from_samples(samples, 4800, rate_hz, rate_hz, &clip));
    MUST(foresound_source_play(engine, source, clip, 1));

    /* Elements of arrays, at the end of their block. */
    ForesoundPose at = {source, {1, 2, 1}, {0, 0, 0, 1}};
    ForesoundPose listener = {0, {-1, 1.5f, -1}, {0, 0, 0, 1}};
    Guarded poses = guarded(2 * sizeof(ForesoundPose), 0xff);
    for (int i = 0; i < 2; i++) memcpy(poses.body + (size_t)i * sizeof at, &at, KNOWN_Pose);
    MUST(foresound_engine_tick(engine, &listener, (ForesoundPose *)poses.body, 2, sizeof at));
    MUST(foresound_instance_add(engine, scene, &listener, sizeof listener, &instance));
    CHECK(instance != 0);
    MUST(foresound_instance_move(engine, instance, &listener, sizeof listener));
    MUST(foresound_instance_remove(engine, instance));
    MUST(foresound_instance_add_joined(engine, scene, &listener, sizeof listener, &instance));
    MUST(foresound_instance_remove(engine, instance));
    REFUSED(foresound_engine_tick(engine, &listener, NULL, 0, KNOWN_Pose - 4));
    REFUSED(foresound_engine_tick(engine, &listener, NULL, 0, 1));
    float loudest = 0;
    for (int tick = 0; tick < 40; tick++) {
        MUST(foresound_engine_tick(engine, &listener, (ForesoundPose *)poses.body, 2, sizeof at));
        MUST(foresound_render(renderer, block, FRAMES, NULL));
        for (int i = 0; i < 2 * FRAMES; i++) loudest = block[i] > loudest ? block[i] : loudest;
    }
    CHECK(loudest > 0.01f);
    OUT(ForesoundRenderInfo, KNOWN_RenderInfo, value, foresound_render(renderer, block, FRAMES, value))
    OUT(ForesoundEngineStatistics, KNOWN_EngineStatistics, value, foresound_engine_statistics(engine, value))
    OUT(ForesoundEngineHealth, KNOWN_EngineHealth, value, foresound_engine_health(engine, value))
    release(&poses, __LINE__);

    Guarded paths = guarded(PATHS * sizeof(ForesoundShownPath) + GUARD, 0xa5);
    size_t count = 0;
    MUST(foresound_engine_paths(engine, (ForesoundShownPath *)paths.body, sizeof(ForesoundShownPath), PATHS, &count));
#ifdef HAS_Options_shown_paths
    CHECK(count >= 2);
#else
    CHECK(count == 0);
#endif
    for (size_t n = 0; n < count; n++) {
        const unsigned char *element = paths.body + n * sizeof(ForesoundShownPath);
        CHECK(((const ForesoundShownPath *)element)->source == source);
        CHECK(((const ForesoundShownPath *)element)->corner_count >= 2);
        for (size_t i = KNOWN_ShownPath; i < sizeof(ForesoundShownPath); i++) CHECK(element[i] == 0);
    }
    for (size_t i = count * sizeof(ForesoundShownPath); i < paths.bytes; i++) CHECK(paths.body[i] == 0xa5);
    release(&paths, __LINE__);

    MUST(foresound_output_start(renderer, 2, &output));
    OUT(ForesoundOutputInfo, KNOWN_OutputInfo, value, foresound_output_info(output, value))
    const uint64_t open[4] = {output, clip, scene, engine};
    for (int i = 0; i < 4; i++) MUST(foresound_close(open[i]));
    MUST(foresound_set_log(FORESOUND_LOG_LEVEL_OFF, NULL, NULL));
    printf("%d checks\n", checks);
    return 0;
}
