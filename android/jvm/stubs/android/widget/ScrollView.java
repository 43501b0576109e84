package android.widget;

import android.content.Context;
import android.view.View;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class ScrollView extends View {
    public ScrollView(Context context) {
        super(context);
    }

    public void addView(View view) {}
}
