package android.media;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public final class AudioFocusRequest {
    /** Makes one. */
    public static final class Builder {
        public Builder(int gain) {}

        public Builder setAudioAttributes(AudioAttributes attributes) {
            return this;
        }

        public Builder setOnAudioFocusChangeListener(AudioManager.OnAudioFocusChangeListener listener) {
            return this;
        }

        public AudioFocusRequest build() {
            throw new UnsupportedOperationException();
        }
    }
}
