package android.media;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class AudioManager {
    public static final int AUDIOFOCUS_GAIN = 1;
    public static final int AUDIOFOCUS_REQUEST_GRANTED = 1;
    public static final String PROPERTY_OUTPUT_SAMPLE_RATE = "android.media.property.OUTPUT_SAMPLE_RATE";

    public String getProperty(String key) {
        return null;
    }

    public int requestAudioFocus(AudioFocusRequest request) {
        return 0;
    }

    public int abandonAudioFocusRequest(AudioFocusRequest request) {
        return 0;
    }

    /** What a change of focus calls. */
    public interface OnAudioFocusChangeListener {
        void onAudioFocusChange(int change);
    }
}
