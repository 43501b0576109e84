/* First sound: a room, a voice in it, a listener who walks. Writes raw 32-bit stereo to the file that is named. */
#include <foresound.h>

#include <stdio.h>
#include <stdlib.h>

static void must(ForesoundStatus status) {
    if (status == FORESOUND_STATUS_OK) return;
    fprintf(stderr, "%s\n", foresound_last_error()); /* what is wrong, and what to do */
    exit(1);
}

int main(int count, char **arguments) {
    if (count != 4) {
        fprintf(stderr, "usage: first SCENE.obj VOICE.wav OUT.raw\n");
        return 2;
    }

    /* An engine and its two halves: one for the game, one for the audio callback. */
    ForesoundOptions options = FORESOUND_OPTIONS_INIT;
    options.rate_hz = 48000;
    /* Into a file, faster than real time. A game leaves these two as they are. */
    options.schedule = FORESOUND_SCHEDULE_SYNCHRONOUS;
    options.frame_s = 1.0 / 60.0;
    uint64_t engine, renderer, scene, clip;
    must(foresound_engine_create(FORESOUND_API_VERSION, &options, NULL, 0, &engine, &renderer));

    /* The scene. A game passes its own triangles to foresound_scene_from_mesh. */
    must(foresound_scene_from_file(arguments[1], NULL, NULL, 0, &scene));
    must(foresound_engine_set_scene(engine, scene));
    must(foresound_close(scene));

    /* A source and its sound. */
    static uint8_t file[1 << 20];
    FILE *wav = fopen(arguments[2], "rb");
    if (!wav) return 3;
    size_t bytes = fread(file, 1, sizeof file, wav);
    fclose(wav);
    if (bytes == sizeof file) return 4; /* longer than the buffer */
    uint32_t voice;
    must(foresound_clip_from_wav(file, bytes, options.rate_hz, &clip));
    must(foresound_source_add(engine, 4.8f, 1.5f, 3.2f, &voice));
    must(foresound_source_play(engine, voice, clip, 1));
    must(foresound_close(clip));

    /* Two seconds of 60 graphics frames. In a game the audio callback renders. On Android foresound_output_start plays
     * instead; elsewhere it opens a null device, which is silent. */
    static float block[2 * 800];
    FILE *out = fopen(arguments[3], "wb");
    if (!out) return 3;
    ForesoundPose listener = {0, {6.5f, 1.65f, 3.0f}, {0, 0, 0, 1}};
    for (int frame = 0; frame < 120; frame++) {
        listener.position_m[0] += 0.02f;
        must(foresound_engine_tick(engine, &listener, NULL, 0, sizeof listener));
        must(foresound_render(renderer, block, 800, NULL));
        fwrite(block, sizeof(float), 2 * 800, out);
    }
    fclose(out);
    must(foresound_close(renderer));
    return foresound_close(engine);
}
