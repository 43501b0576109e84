package android.media;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public final class AudioAttributes {
    public static final int USAGE_GAME = 14;
    public static final int CONTENT_TYPE_SONIFICATION = 4;

    /** Makes them. */
    public static class Builder {
        public Builder setUsage(int usage) {
            return this;
        }

        public Builder setContentType(int type) {
            return this;
        }

        public AudioAttributes build() {
            throw new UnsupportedOperationException();
        }
    }
}
